"""Composition of the YuMi: one arm model mounted twice, mirror-wise, on the body."""

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

FINGER_SPEED = 0.025
"""Speed of each finger [m/s] (ABB servo gripper, default setting)."""

# Bits of contype and conaffinity. Each arm meets everything but itself: its own links are kept
# apart by the joint limits, and hull contacts between neighbours would be false.
_CONTACT_BITS = {"right": (2, 1 | 4), "left": (4, 1 | 2)}


def arm_spec(arm: str) -> mujoco.MjSpec:
    """Model of one arm, its contacts set up for the `arm` side ("right" or "left")."""
    spec = mujoco.MjSpec.from_file(str(assets_folder() / "abb_yumi" / "arm.xml"))
    set_contacts(spec, arm)
    return spec


def set_contacts(spec: mujoco.MjSpec, arm: str) -> None:
    """Let the collision shapes (group 3) of an arm or a hand meet everything but its own side."""
    contype, conaffinity = _CONTACT_BITS[arm]
    for geom in spec.geoms:
        if geom.group == 3:
            geom.contype, geom.conaffinity = contype, conaffinity


def mount_yumi(spec: mujoco.MjSpec, arms: tuple[str, ...] = ARMS) -> None:
    """Put YuMi's body ("yumi_") with the given arms ("right_", "left_") at the world's origin."""
    body = mujoco.MjSpec.from_file(str(assets_folder() / "abb_yumi" / "body.xml"))
    spec.attach(body, frame=spec.worldbody.add_frame(), prefix="yumi_")
    for arm in arms:
        spec.attach(arm_spec(arm), site=spec.site(f"yumi_{arm}_mount"), prefix=f"{arm}_")


def planning_model(arm: str) -> mujoco.MjModel:
    """Body with one arm whose joint ranges are the soft limits: what inverse kinematics sees."""
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    mount_yumi(spec, (arm,))
    for name, limits in zip(ARM_JOINTS[arm], SOFT_LIMITS, strict=True):
        spec.joint(name).range = limits
    return spec.compile()
