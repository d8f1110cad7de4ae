"""`teasim/TeaMaking-v0`: joint targets of both arms and gripper openings at 10 Hz."""

from typing import Any

import numpy as np
from gymnasium import spaces

from teasim.constants import ARM_JOINTS, ARMS, GRIPPER_OPEN, GRIPPER_SQUEEZE, SUBTASKS
from teasim.envs.base import StationEnv


class TeaMakingEnv(StationEnv):
    """Drive both arms: 14 joint targets, then the openings of the right and the left gripper.

    Actions in [-1, 1] span the joints' ranges; for the grippers -1 squeezes with full force and 1
    is wide open. Each completed sub-task earns 1/7, the goal 1.
    """

    def __init__(self, **kwargs: Any) -> None:
        """Take the arguments of `StationEnv`."""
        super().__init__(**kwargs)
        model = self._simulation.model
        ranges = [model.joint(name).range for arm in ARMS for name in ARM_JOINTS[arm]]
        limits = np.array([*ranges, *[(GRIPPER_SQUEEZE, GRIPPER_OPEN)] * 2])
        self._middle = limits.mean(axis=1)
        self._reach = np.ptp(limits, axis=1) / 2
        self.action_space = spaces.Box(-1.0, 1.0, (16,), np.float32)
        self._counted = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start a new episode."""
        self._counted = 0
        return super().reset(seed=seed, options=options)

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance 0.1 s towards the targets."""
        self._simulation.step(self.target(np.asarray(action, dtype=np.float64)))
        verdict = self._verdict()
        different = len(set(self._simulation.subtasks_done))
        reward = (different - self._counted) / len(SUBTASKS) + float(verdict.success)
        self._counted = different
        return self._observation(), reward, verdict.success, False, self._info(verdict)

    def target(self, action: np.ndarray) -> np.ndarray:
        """Joint angles [rad] and openings [m] (16,) of an action in [-1, 1]."""
        return np.asarray(self._middle + self._reach * np.clip(action, -1, 1))

    def action(self, target: np.ndarray) -> np.ndarray:
        """Action in [-1, 1] (16,) float32 of joint angles [rad] and openings [m]."""
        return ((target - self._middle) / self._reach).astype(np.float32)
