"""Who works at the station: the bodies a skill can be carried out with."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import mujoco
import numpy as np

from teasim.common.registry import named
from teasim.constants import ARM_JOINTS
from teasim.world.person import (
    HAND_JOINTS,
    HAND_RANGE,
    HAND_SPEEDS,
    HANDS_READY,
    Limbs,
    mount_person,
)
from teasim.world.yumi import FINGER_SPEED, JOINT_SPEEDS, READY, SOFT_LIMITS, mount_yumi

Painter = Callable[[mujoco.MjData], None]


def _nothing_to_paint(model: mujoco.MjModel) -> Painter:  # noqa: ARG001
    return lambda data: None  # noqa: ARG005


@dataclass(frozen=True, eq=False)
class Embodiment:
    """A body with two arms of n joints each, every one with its own motor, and two fingers each.

    A target holds the right arm's joints, the left arm's, and both openings: (2 n + 2,).
    """

    name: str
    """Name in the registry."""
    joints: Mapping[str, tuple[str, ...]]
    """Names of the joints, and of their motors, per side."""
    ready: Mapping[str, np.ndarray]
    """Start and park pose per side (n,) [rad or m]."""
    limits: np.ndarray
    """Planning limits (n, 2) [rad or m]."""
    speeds: np.ndarray
    """Largest joint speeds (n,) [rad/s or m/s]."""
    reach_speeds: np.ndarray
    """Peak joint speeds of free motions at nominal tempo (n,) [rad/s or m/s]."""
    bow: np.ndarray
    """Which joints a style's bow moves aside in free motions, and how much of it (n,)."""
    arc: np.ndarray
    """How far the joints leave the straight way in the middle of free motions (n,) [rad or m]."""
    finger_speed: float
    """Speed of each finger [m/s]."""
    mount: Callable[[mujoco.MjSpec], None]
    """Puts the body into a station."""
    painter: Callable[[mujoco.MjModel], Painter] = field(default=_nothing_to_paint)
    """Makes what brings shapes up to date that physics does not move."""
    either_hand: frozenset[str] = frozenset()
    """Sub-tasks that can be done with the right hand as well as with the left."""

    @property
    def width(self) -> int:
        """Number of joints of one arm."""
        return len(self.speeds)


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
    either_hand=frozenset({"add_tea_bag", "stir"}),
)

EMBODIMENTS: Mapping[str, Embodiment] = MappingProxyType(
    {embodiment.name: embodiment for embodiment in (YUMI, PERSON)}
)


def find_embodiment(name: str) -> Embodiment:
    """Return the embodiment of this name.

    Raises:
        ConfigError: there is none.
    """
    return named("embodiment", EMBODIMENTS, name)
