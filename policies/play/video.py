"""Videos of an episode: what the policy saw at each decision, with the chosen sub-task below it."""

from pathlib import Path
from typing import Any

import cv2
import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from policies.data.samples import Observation, Policy, pictures
from teasim.pool.clips import VideoWriter

STRIP = 24
"""Height of the strip below the picture [pixel]; even, as the video codec needs it."""
LARGEST = 0.5
"""Largest font scale; a long text below a narrow picture gets a smaller one."""
WHITE = (255, 255, 255)
"""Colour of the text, RGB."""


def picture(env: gym.Env[Any, Any], observation: Observation, policy: Policy) -> NDArray[np.uint8]:
    """Return what `policy` sees, its cameras side by side, (H, K * W, 3).

    For a policy without cameras it is what the environment renders.
    """
    if not policy.spec.cameras:
        rendered: NDArray[np.uint8] = np.asarray(env.render())
        return rendered
    return np.hstack(list(pictures(observation, policy.spec.cameras).values()))


def caption(frame: NDArray[np.uint8], text: str) -> NDArray[np.uint8]:
    """Return `frame` (H, W, 3) with `text` in a dark strip below it, (H + STRIP, W, 3)."""
    strip = np.zeros((STRIP, *frame.shape[1:]), dtype=np.uint8)
    (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 1.0, 1)
    scale = min(LARGEST, 0.95 * frame.shape[1] / width)
    line = cv2.LINE_AA
    cv2.putText(strip, text, (2, STRIP - 8), cv2.FONT_HERSHEY_SIMPLEX, scale, WHITE, 1, line)
    return np.vstack([frame, strip])


def write_video(
    path: Path, frames: list[NDArray[np.uint8]], chosen: list[str], success: bool
) -> None:
    """Write `frames` (H, W, 3), one per decision and the last one, at one frame per second.

    Args:
        path: mp4 file; its folder is created.
        frames: pictures before each decision and after the last.
        chosen: sub-task chosen at each decision, one fewer than `frames`.
        success: whether the goal was reached, for the last caption.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    captions = [f"{number} {name}" for number, name in enumerate(chosen, start=1)]
    captions.append("goal reached" if success else "goal not reached")
    captioned = [caption(frame, text) for frame, text in zip(frames, captions, strict=True)]
    height, width, _ = captioned[0].shape
    video = VideoWriter(path, height=height, width=width, fps=1)
    for frame in captioned:
        video.add(frame)
    video.close()
