"""The bodies that can work at the station, and every fact about them that others need."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import mujoco
import numpy as np

from teasim.common.registry import named
from teasim.constants import ARM_JOINTS, ARMS, GRIPPER_OPEN, GRIPPER_SQUEEZE
from teasim.world.bodies.person import (
    HAND_JOINTS,
    HAND_RANGE,
    HAND_SPEEDS,
    HANDS_READY,
    Limbs,
    mount_person,
)
from teasim.world.bodies.yumi import (
    FINGER_SPEED,
    JOINT_SPEEDS,
    POSTURES,
    READY,
    SOFT_LIMITS,
    mount_yumi,
)

Painter = Callable[[mujoco.MjData], None]


def _nothing_to_paint(model: mujoco.MjModel) -> Painter:  # noqa: ARG001
    return lambda data: None  # noqa: ARG005


@dataclass(frozen=True, eq=False)
class Embodiment:
    """A body with two arms of n joints, each with its own motor, and two fingers per arm.

    A target is the right arm's joints, the left arm's joints, and both openings: (2 n + 2,).
    """

    name: str
    """Name in the registry."""
    joints: Mapping[str, tuple[str, ...]]
    """Names of the joints, and of their motors, by side."""
    ready: Mapping[str, np.ndarray]
    """Start and park pose by side (n,) [rad or m]."""
    limits: np.ndarray
    """Planning limits (n, 2) [rad or m]."""
    speeds: np.ndarray
    """Largest joint speeds (n,) [rad/s or m/s]."""
    reach_speeds: np.ndarray
    """Peak joint speeds of free motions at nominal tempo (n,) [rad/s or m/s]."""
    bow: np.ndarray
    """Weight of every joint in the sideways bow that a style adds to free motions (n,)."""
    arc: np.ndarray
    """Deviation of the joints from the straight way amid free motions (n,) [rad or m]."""
    finger_speed: float
    """Speed of each finger [m/s]."""
    mount: Callable[[mujoco.MjSpec], None]
    """Adds the body to a station."""
    openings: tuple[float, float] = (GRIPPER_SQUEEZE, GRIPPER_OPEN)
    """Opening commands of the grippers: squeezing with full force, and wide open [m]."""
    postures: Mapping[str, tuple[tuple[float, ...], ...]] = field(default_factory=dict)
    """Joint angles an arm stays near by sub-task, best first (n,) [rad]; by default `ready`."""
    painter: Callable[[mujoco.MjModel], Painter] = field(default=_nothing_to_paint)
    """Makes a function that updates shapes which physics does not move."""
    equal_hands: bool = False
    """Whether either hand can do what does not depend on the reach of one arm."""
    logged: bool = True
    """Whether demonstrations have a log of states and actions; without one they are films only."""
    robot_type: str | None = None
    """Name of the robot in pools; None for a person."""

    @property
    def width(self) -> int:
        """Number of joints of one arm."""
        return len(self.speeds)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the dimensions of a target, which are the columns of the joint log."""
        joints = (name for arm in ARMS for name in self.joints[arm])
        return (*joints, *(f"{arm}_gripper" for arm in ARMS))


YUMI = Embodiment(
    name="yumi",
    joints=MappingProxyType(ARM_JOINTS),
    ready=MappingProxyType(READY),
    limits=SOFT_LIMITS,
    speeds=JOINT_SPEEDS,
    reach_speeds=np.full(7, 1.2),
    bow=np.array([1.0, 0, 0, 0, 0, 0, 0]),
    arc=np.zeros(7),
    finger_speed=FINGER_SPEED,
    mount=mount_yumi,
    postures=POSTURES,
    robot_type="abb_yumi",
)

PERSON = Embodiment(
    name="person",
    joints=MappingProxyType(HAND_JOINTS),
    ready=MappingProxyType(HANDS_READY),
    limits=HAND_RANGE,
    speeds=HAND_SPEEDS,
    reach_speeds=np.array([0.36, 0.36, 0.36, 2.0, 2.0, 2.0]),
    bow=np.array([0, 0.5, 0, 0, 0, 0]),
    arc=np.array([0, 0, 0.06, 0, 0, 0]),  # a hand that crosses the table passes above the cup
    finger_speed=0.06,
    mount=mount_person,
    painter=lambda model: Limbs(model).paint,
    equal_hands=True,
    logged=False,
)

EMBODIMENTS: Mapping[str, Embodiment] = MappingProxyType(
    {embodiment.name: embodiment for embodiment in (YUMI, PERSON)}
)
"""All embodiments by name."""


def find_embodiment(name: str) -> Embodiment:
    """Return the embodiment of this name.

    Raises:
        ConfigError: there is none.
    """
    return named("embodiment", EMBODIMENTS, name)
