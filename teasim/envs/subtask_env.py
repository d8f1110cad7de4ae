"""`teasim/TeaMakingSubtasks-v0`: every action is a whole sub-task, done in full physics."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from gymnasium import spaces

from teasim.common.errors import ConfigError, SkillError
from teasim.constants import CONTROL_TIMESTEP, SUBTASKS
from teasim.envs.base import StationEnv
from teasim.rollout import run_subtask
from teasim.skills.arm import Style

REFUSED_SECONDS = 1.0
"""The robot waits this long when a sub-task cannot be done from the present state [s]."""


class TeaMakingSubtasksEnv(StationEnv):
    """Choose the next of the seven sub-tasks; the scripted skill carries it out.

    An action that cannot be done (a second tea bag, say) passes as a moment of waiting and is
    named in `info["refused"]`. The reward is 1 when the goal is reached, 0 otherwise.
    """

    def __init__(
        self,
        obs_type: str = "state",
        cameras: Sequence[str] = ("left", "cup"),
        width: int = 224,
        height: int = 224,
        render_mode: str | None = None,
        quality: str = "fast",
        randomize: bool = True,
        look: str = "fixed",
        max_actions: int = 14,
    ) -> None:
        """As `StationEnv`; the episode is cut off after `max_actions` actions.

        Raises:
            ConfigError: an argument is unknown or out of range.
        """
        super().__init__(obs_type, cameras, width, height, render_mode, quality, randomize, look)
        if max_actions < 1:
            raise ConfigError(f"max_actions is {max_actions}; choose 1 or more.")
        self.action_space = spaces.Discrete(len(SUBTASKS))
        self._max_actions = max_actions
        self._actions = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start a new episode."""
        self._actions = 0
        return super().reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Carry out sub-task number `action`.

        Raises:
            ConfigError: there is no sub-task of that number; nothing has moved then.
        """
        refused = self._carry_out(_subtask(action))
        self._actions += 1
        verdict = self._verdict()
        reward = float(verdict.success)
        info = self._info(verdict) | {"refused": refused, "reward_terms": {"success": reward}}
        truncated = not verdict.success and self._actions >= self._max_actions
        return self._observation(), reward, verdict.success, truncated, info

    def _carry_out(self, subtask: str) -> str:
        try:
            run_subtask(self._simulation, subtask, Style())
        except SkillError as error:
            self._recover()
            return str(error)
        return ""

    def _recover(self) -> None:
        """Stand still for a moment; skills refuse before they move."""
        target = np.array(self._simulation.target)
        for _ in range(round(REFUSED_SECONDS / CONTROL_TIMESTEP)):
            self._simulation.step(target)

    def _progress(self) -> Any:
        return self._actions

    def _set_progress(self, progress: Any) -> None:
        self._actions = progress


def _subtask(action: Any) -> str:
    number = np.asarray(action)
    if number.dtype.kind in "iu" and number.size == 1 and 0 <= number.item() < len(SUBTASKS):
        return SUBTASKS[number.item()]
    raise ConfigError(f"Unknown action {action!r}; choose a number from 0 to {len(SUBTASKS) - 1}.")
