"""Videos of an episode: the motion of every sub-task, with its name below it."""

from pathlib import Path
from typing import Any, Self

import cv2
import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from policies.data.samples import Observation, Policy, pictures
from teasim.pool.clips import VideoWriter

FILM = "rgb_array_list"
"""Render mode of environments that take pictures in the middle of an action."""
STRIP = 24
"""Height of the strip below the picture [pixel]; even, as the video codec needs it."""
LARGEST = 0.5
"""Largest font scale; a long text below a narrow picture gets a smaller one."""
WHITE = (255, 255, 255)
"""Colour of the text, RGB."""
ENDING = 2.0
"""Time for which the last picture is shown, with whether the goal was reached [s]."""


def moves(env: gym.Env[Any, Any]) -> bool:
    """Tell whether `env` takes pictures in the middle of an action."""
    return env.render_mode == FILM and FILM in env.unwrapped.metadata["render_modes"]


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


class Film:
    """The video of one episode, written while it is played.

    Where the environment shows no motion there is one picture per decision, a second each.
    """

    def __init__(self, path: Path, env: gym.Env[Any, Any], policy: Policy) -> None:
        """Film `policy` in `env`; `path` is an mp4 file, whose folder is made."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path, self._env, self._policy = path, env, policy
        self._moves = moves(env)
        self._fps = float(env.unwrapped.metadata["render_fps"]) if self._moves else 1.0
        self._video: VideoWriter | None = None
        self._last: NDArray[np.uint8] | None = None
        self._decisions = 0

    def __enter__(self) -> Self:
        """Begin."""
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        """Finish the file, or leave it if the episode failed."""
        if self._video is not None:
            self._video.abort() if kind else self._video.close()

    def before(self, observation: Observation, name: str) -> None:
        """Show what there is before sub-task `name`, which is written below it and its motion."""
        self._decisions += 1
        self._text = f"{self._decisions} {name}"
        if self._moves:
            self._add(self._taken())  # the start of the episode
        else:
            self._add([picture(self._env, observation, self._policy)])

    def after(self) -> None:
        """Show the motion of the sub-task."""
        if self._moves:
            self._add(self._taken())

    def end(self, observation: Observation, success: bool) -> None:
        """Show how it ended."""
        self._text = "goal reached" if success else "goal not reached"
        if not self._moves:
            self._add([picture(self._env, observation, self._policy)])
        elif self._last is not None:
            self._add([self._last] * round(ENDING * self._fps))

    def _taken(self) -> list[NDArray[np.uint8]]:
        frames: Any = self._env.render()
        return list(frames)

    def _add(self, frames: list[NDArray[np.uint8]]) -> None:
        for frame in frames:
            self._last = frame
            shown = caption(frame, self._text)
            if self._video is None:
                height, width, _ = shown.shape
                self._video = VideoWriter(self._path, height=height, width=width, fps=self._fps)
            self._video.add(shown)
