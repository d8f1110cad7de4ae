"""`teasim/TeaMakingSubtasks-v0`: every action is a whole sub-task, carried out in full physics."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from teasim.common.errors import SkillError
from teasim.constants import CONTROL_TIMESTEP, SUBTASKS
from teasim.envs.base import StationEnv
from teasim.envs.decisions import (
    DecisionWeights,
    check_max_actions,
    decision_terms,
    subtask_of,
)
from teasim.rollout import run_subtask
from teasim.skills.style import Style

REFUSED_SECONDS = 1.0
"""Rest after an action that cannot be carried out from the present state [s]."""


class TeaMakingSubtasksEnv(StationEnv):
    """Choose the next sub-task; a scripted skill carries it out.

    When an action cannot be carried out, for example a second tea bag, the robot waits for a moment
    and `info["refused"]` says why. The reward is 1 when the goal is reached, 0 otherwise, unless
    `reward_weights` gives weights to other terms of `decision_terms`.
    """

    def __init__(
        self,
        *,
        max_actions: int = 14,
        reward_weights: Mapping[str, float] | None = None,
        **kwargs: Any,
    ) -> None:
        """Build the station.

        Args:
            max_actions: The episode is truncated after this number of actions.
            reward_weights: Weights of terms of the reward that replace those of `DecisionWeights`.
            **kwargs: The arguments of `StationEnv`.

        Raises:
            ConfigError: an argument is unknown or out of range.
        """
        self._weights = DecisionWeights.of(reward_weights)
        self._max_actions = check_max_actions(max_actions)
        super().__init__(**kwargs)
        self.action_space = spaces.Discrete(len(SUBTASKS))
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
        subtask, before, done = subtask_of(action), self._verdict(), self._simulation.subtasks_done
        refused = self._carry_out(subtask)
        self._actions += 1
        verdict = self._verdict()
        terms = decision_terms(subtask, done, self._simulation.subtasks_done, (before, verdict))
        info = self._info(verdict) | {"refused": refused, "reward_terms": terms}
        truncated = not verdict.success and self._actions >= self._max_actions
        reward = self._weights.total(terms)
        return self._observation(), reward, verdict.success, truncated, info

    def _carry_out(self, subtask: str) -> str:
        try:
            run_subtask(self._simulation, subtask, Style())
        except SkillError as error:
            self._recover()
            return str(error)
        return ""

    def _recover(self) -> None:
        """Rest for a moment; a skill that cannot be carried out has not moved anything."""
        target = np.array(self._simulation.target)
        for _ in range(round(REFUSED_SECONDS / CONTROL_TIMESTEP)):
            self._simulation.step(target)

    def _progress(self) -> Any:
        return self._actions

    def _set_progress(self, progress: Any) -> None:
        self._actions = progress
