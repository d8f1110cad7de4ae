"""`teasim/TeaMaking-v0`: joint targets of both arms and gripper openings at 10 Hz."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from teasim.envs.actions import check_action, make_control
from teasim.envs.base import StationEnv
from teasim.envs.rewards import RewardTerms, RewardWeights


class TeaMakingEnv(StationEnv):
    """Drive both arms: the joint targets, then the openings of the right and the left gripper.

    Actions are clipped to [-1, 1]. For the grippers -1 squeezes with full force and 1 is wide open.
    For the joints `control` sets the meaning: `position` spans the ranges of the joints; `delta`
    changes the last target by at most `DELTA_SHARE` of what the largest joint speed covers in a
    step.

    Every sub-task that is completed for the first time earns 1/7 and the goal 1; spills,
    collisions and an oven left on cost a little. `info["reward_terms"]` holds the terms of
    `RewardTerms`; the reward is their sum weighted by `RewardWeights`.
    """

    def __init__(
        self,
        *,
        control: str = "position",
        reward_weights: Mapping[str, float] | None = None,
        **kwargs: Any,
    ) -> None:
        """Build the station.

        Args:
            control: Meaning of the joints' actions, position or delta.
            reward_weights: Weights of reward terms that replace the default ones.
            **kwargs: The arguments of `StationEnv`.

        Raises:
            ConfigError: an argument is unknown or out of range.
        """
        self._weights = RewardWeights.of(reward_weights)
        super().__init__(**kwargs)
        body = self._simulation.embodiment
        self._names = body.state_names
        self._control = make_control(control, body, self._simulation.model)
        self._terms = RewardTerms(self._simulation)
        self.action_space = spaces.Box(-1.0, 1.0, (len(self._names),), np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start a new episode."""
        observation, info = super().reset(seed=seed, options=options)
        self._terms.reset()
        return observation, info

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance 0.1 s towards the targets.

        Raises:
            ConfigError: the action is not one finite number per dimension; nothing has moved then.
        """
        self._simulation.step(self.target(check_action(action, self._names)))
        verdict = self._verdict()
        terms = self._terms.take(verdict)
        info = self._info(verdict) | {"reward_terms": terms}
        return self._observation(), self._weights.total(terms), verdict.success, False, info

    def target(self, action: np.ndarray) -> np.ndarray:
        """Return the joint angles [rad] and openings [m] (16,) of an action (16,) now."""
        return self._control.target(action, self._simulation.target)

    def action(self, target: np.ndarray) -> np.ndarray:
        """Return the action (16,) float32 for these joint angles [rad] and openings [m] now."""
        return self._control.action(target, self._simulation.target).astype(np.float32)

    def _progress(self) -> Any:
        return self._terms.state()

    def _set_progress(self, progress: Any) -> None:
        self._terms.restore(progress)
