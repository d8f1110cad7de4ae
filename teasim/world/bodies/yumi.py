"""Composition of the YuMi: one arm model, mounted on both sides of the body."""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

import mujoco
import numpy as np

from teasim.constants import ARM_JOINTS, ARMS, assets_folder

# ABB axis order 1 2 7 3 4 5 6, degrees: gripper pointing down in front of the body.
_READY_RIGHT = (51.16, -99.4, -36.0, 21.57, -107.19, 84.11, 94.61)
_READY_LEFT = (-51.16, -99.4, 36.0, 21.57, 107.19, 84.11, 94.61)
READY = {"right": np.radians(_READY_RIGHT), "left": np.radians(_READY_LEFT)}
"""Start and park pose of each arm [rad], kinematic order (7,)."""

# MoveIt's soft limits (yumi_description, joint_limits.yaml) in kinematic order: what is planned
# stays this far inside the hard limits of the model.
SOFT_LIMITS = np.array(
    [
        (-2.84, 2.84),
        (-2.40, 0.65),
        (-2.84, 2.84),
        (-2.00, 1.29),
        (-4.90, 4.90),
        (-1.43, 2.30),
        (-3.89, 3.89),
    ]
)
"""Planning limits of the joints [rad], kinematic order (7, 2)."""

JOINT_SPEEDS = np.radians((180, 180, 180, 180, 400, 400, 400))
"""Largest joint speeds [rad/s], kinematic order (7,) (ABB product specification 3HAC052982)."""

POSTURES: Mapping[str, tuple[tuple[float, ...], ...]] = MappingProxyType(
    {
        "add_water": ((1.61, -2.00, -1.65, 0.48, -0.81, -0.17, 1.86),),
        "add_sugar": (
            (-0.40, -1.89, 0.97, 0.01, -0.19, 0.45, 0.82),
            (-0.78, -2.35, 1.04, 0.62, -0.59, 1.50, 0.21),
        ),
        "add_milk": (
            (-1.48, -2.08, 0.60, 0.65, 1.80, 1.17, 0.35),
            (-1.36, -1.49, 2.11, 0.25, 1.04, 0.77, -0.35),
            (-1.07, -2.15, 0.75, 0.14, 1.32, 1.95, 1.56),
        ),
    }
)
"""Joint angles the arm stays near by sub-task, best first [rad], kinematic order; default READY.

Found by random search over 60 layouts: the whole path from the grasp to the full tilt stays inside
the soft limits, and no joint exceeds its speed. From READY the elbow runs into its limit.
"""

FINGER_SPEED = 0.025
"""Speed of each finger [m/s] (ABB servo gripper, default setting)."""

# Bits of contype and conaffinity. Each arm collides with everything but itself: the joint limits
# keep its own links apart, and contacts between the hulls of neighbours would be false.
_CONTACT_BITS = {"right": (2, 1 | 4), "left": (4, 1 | 2)}


def arm_spec(arm: str) -> mujoco.MjSpec:
    """Return the model of one arm with the contacts of the `arm` side ("right" or "left")."""
    spec = mujoco.MjSpec.from_file(str(assets_folder() / "abb_yumi" / "arm.xml"))
    set_contacts(spec, arm)
    return spec


def set_contacts(spec: mujoco.MjSpec, arm: str) -> None:
    """Let the collision shapes (group 3) of an arm or a hand touch everything but its own side."""
    contype, conaffinity = _CONTACT_BITS[arm]
    for geom in spec.geoms:
        if geom.group == 3:
            geom.contype, geom.conaffinity = contype, conaffinity


def mount_yumi(spec: mujoco.MjSpec, arms: tuple[str, ...] = ARMS) -> None:
    """Add YuMi's body ("yumi_") with the given arms ("right_", "left_") at the world's origin."""
    body = mujoco.MjSpec.from_file(str(assets_folder() / "abb_yumi" / "body.xml"))
    spec.attach(body, frame=spec.worldbody.add_frame(), prefix="yumi_")
    for arm in arms:
        spec.attach(arm_spec(arm), site=spec.site(f"yumi_{arm}_mount"), prefix=f"{arm}_")


@cache
def planning_model(arm: str) -> mujoco.MjModel:
    """Return the body with one arm whose joint ranges are the soft limits, for kinematics.

    It is compiled once per process and must not be changed.
    """
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    mount_yumi(spec, (arm,))
    for name, limits in zip(ARM_JOINTS[arm], SOFT_LIMITS, strict=True):
        spec.joint(name).range = limits
    return spec.compile()
