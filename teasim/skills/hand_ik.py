"""Kinematics of a person's flying hand in closed form: a place and three turns about x, y, z."""

import numpy as np
from mink import SE3

from teasim.common.errors import SkillError
from teasim.skills.geometry import about, pose, position, rotation
from teasim.world.bodies.person import HAND_RANGE, POINTING_DOWN

_AXES = np.eye(3)


ROUNDING = 1e-9
"""Largest distance of a solution from the planning limits, for rounding [m, rad]."""


class HandKinematics:
    """Forward and inverse kinematics of one hand at its tool centre point.

    R = Rx(roll) Ry(pitch) Rz(yaw) R_down, unique for |pitch| < 90 degrees: a hand may point in
    any direction but straight back or straight ahead.
    """

    def __init__(self, arm: str) -> None:
        self._arm = arm
        self._down = POINTING_DOWN[arm]

    def prefer(self, posture: np.ndarray) -> None:
        """Do nothing: there is no spare joint that a `posture` (6,) could decide."""

    def pose(self, joints: np.ndarray) -> SE3:
        """Return the pose of the tool centre point at coordinates (6,) [m, rad]."""
        roll, pitch, yaw = (about(a, t) for a, t in zip(_AXES, joints[3:], strict=True))
        return pose(joints[:3], roll @ pitch @ yaw @ self._down)

    def solve(self, goal: SE3, seed: np.ndarray) -> np.ndarray:
        """Return coordinates (6,) [m, rad] of `goal`, with the turns nearest to `seed` (6,).

        Raises:
            SkillError: it is outside of the planning limits.
        """
        turned = rotation(goal) @ self._down.T
        turns = np.array(
            [
                np.arctan2(-turned[1, 2], turned[2, 2]),
                np.arcsin(np.clip(turned[0, 2], -1, 1)),
                np.arctan2(-turned[0, 1], turned[0, 0]),
            ]
        )
        turns += 2 * np.pi * np.round((seed[3:] - turns) / (2 * np.pi))
        joints = np.concatenate([position(goal), turns])
        low, high = HAND_RANGE.T
        if (joints < low - ROUNDING).any() or (joints > high + ROUNDING).any():
            x, y, z = position(goal)
            raise SkillError(
                f"The {self._arm} hand cannot reach ({x:.3f}, {y:.3f}, {z:.3f}) m in the wanted "
                "orientation; move the object nearer to its nominal place."
            )
        return joints
