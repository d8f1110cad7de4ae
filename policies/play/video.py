"""Videos of an episode, with the chosen sub-task below the picture."""

from collections.abc import Callable, Mapping
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


class EpisodeVideo:
    """The video of one episode, an mp4 file that is written while it is played.

    An environment that can be filmed (`env.unwrapped.film`) is seen in motion, at the frame rate
    that its metadata name; of another one there is a picture per decision, one a second.
    """

    def __init__(self, path: Path, env: gym.Env[Any, Any], policy: Policy) -> None:
        """Begin to film; the folder of `path` is created."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path, self._env, self._policy = path, env, policy
        self._film: Callable[..., None] | None = getattr(env.unwrapped, "film", None)
        self._fps = int(env.unwrapped.metadata["render_fps"]) if self._film else 1
        self._text, self._count = "", 0
        self._writer: VideoWriter | None = None
        if self._film:
            self._film(self._take)

    def choose(self, observation: Observation, name: str) -> None:
        """Go on with sub-task `name`, which was chosen by `observation`."""
        self._count += 1
        self._text = f"{self._count} {name}"
        if not self._film:
            self._add(picture(self._env, observation, self._policy))

    def end(self, observation: Observation, success: bool) -> None:
        """Show for a second what was reached, and close the file."""
        self._text = "goal reached" if success else "goal not reached"
        last = picture(self._env, observation, self._policy)
        for _ in range(self._fps):
            self._add(last)
        if self._film:
            self._film(None)
        if self._writer is not None:
            self._writer.close()

    def _take(self, seen: Mapping[str, NDArray[np.uint8]]) -> None:
        cameras = self._policy.spec.cameras or tuple(seen)[:1]
        self._add(np.hstack([seen[camera] for camera in cameras]))

    def _add(self, frame: NDArray[np.uint8]) -> None:
        captioned = caption(frame, self._text)
        if self._writer is None:
            height, width, _ = captioned.shape
            self._writer = VideoWriter(self._path, height=height, width=width, fps=self._fps)
        self._writer.add(captioned)


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
