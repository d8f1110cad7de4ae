"""Inverse kinematics of one arm; YuMi's by mink's quadratic programs with the soft limits."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Protocol

import mink
import numpy as np

from teasim.common.errors import SkillError
from teasim.constants import ARM_JOINTS
from teasim.skills.geometry import position
from teasim.skills.hand_ik import HandKinematics
from teasim.world.bodies.yumi import READY, planning_model

POSITION_TOLERANCE = 5e-4
"""Largest position error of a solution [m]."""
ANGLE_TOLERANCE = 5e-3
"""Largest orientation error of a solution [rad]."""
_ITERATIONS = 40


class Kinematics(Protocol):
    """Converts between the joints of one arm (n,) and the pose of its tool centre point."""

    def prefer(self, posture: np.ndarray) -> None:
        """Stay near `posture` (n,) where there is a choice."""

    def pose(self, joints: np.ndarray) -> mink.SE3:
        """Return the pose at `joints` (n,)."""

    def solve(self, goal: mink.SE3, seed: np.ndarray) -> np.ndarray:
        """Return joints (n,) near `seed` (n,) that reach `goal`, or raise `SkillError`."""


class ArmKinematics:
    """Forward and inverse kinematics of one arm at its tool centre point.

    The arm has seven joints for six coordinates; the spare one is used to stay near a reference
    posture, so the same pose always gives nearly the same joint angles. The posture and the last
    configuration are state: every user needs an instance of its own.
    """

    def __init__(self, arm: str) -> None:
        self._configuration = mink.Configuration(planning_model(arm))
        model = self._configuration.model
        self._address = np.array([model.joint(name).qposadr[0] for name in ARM_JOINTS[arm]])
        self._tcp = f"{arm}_tcp"
        self._frame = mink.FrameTask(
            self._tcp, "site", position_cost=1.0, orientation_cost=0.3, lm_damping=1e-4
        )
        self._posture = mink.PostureTask(model, cost=2e-3)
        self.prefer(READY[arm])
        self._limits = [mink.ConfigurationLimit(model)]

    def prefer(self, posture: np.ndarray) -> None:
        """Stay near `posture` (7,) [rad] from now on."""
        self._posture.set_target(self._full(posture))

    def _full(self, joints: np.ndarray) -> np.ndarray:
        q = np.zeros(self._configuration.model.nq)
        q[self._address] = joints
        return q

    def pose(self, joints: np.ndarray) -> mink.SE3:
        """Return the pose of the tool centre point at joint angles (7,) [rad]."""
        self._configuration.update(self._full(joints))
        return self._configuration.get_transform_frame_to_world(self._tcp, "site")

    def solve(self, goal: mink.SE3, seed: np.ndarray) -> np.ndarray:
        """Return joint angles (7,) [rad] for the pose `goal`, searched from `seed` (7,) [rad].

        Raises:
            SkillError: no solution within the tolerances and the soft limits.
        """
        self._configuration.update(self._full(seed))
        self._frame.set_target(goal)
        for _ in range(_ITERATIONS):
            error = self._frame.compute_error(self._configuration)
            if self._close(error):
                return np.array(self._configuration.q[self._address])
            velocity = mink.solve_ik(
                self._configuration,
                [self._frame, self._posture],
                1.0,
                "daqp",
                limits=self._limits,
            )
            self._configuration.integrate_inplace(velocity, 1.0)
        x, y, z = position(goal)
        raise SkillError(
            f"The {self._tcp.removesuffix('_tcp')} arm cannot reach ({x:.3f}, {y:.3f}, {z:.3f}) m "
            "in the wanted orientation; move the object nearer to its nominal place."
        )

    @staticmethod
    def _close(error: np.ndarray) -> bool:
        near = np.linalg.norm(error[:3]) < POSITION_TOLERANCE
        return bool(near and np.linalg.norm(error[3:]) < ANGLE_TOLERANCE)


KINEMATICS: Mapping[str, Callable[[str], Kinematics]] = MappingProxyType(
    {"yumi": ArmKinematics, "person": HandKinematics}
)
"""The kinematics of every embodiment."""


def kinematics(arm: str, embodiment: str = "yumi") -> Kinematics:
    """Return new kinematics of an arm; they share nothing that changes with earlier ones."""
    return KINEMATICS[embodiment](arm)
