"""Model of a person: two hands in physics; arms, torso and head are drawn to match them.

Only the hands have contacts. The poses of forearms, upper arms and torso are computed before each
picture, by closed-form kinematics of two links.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np

from teasim.constants import ARMS, assets_folder
from teasim.world.bodies.yumi import set_contacts

HAND_JOINTS = {
    arm: tuple(f"{arm}_{name}" for name in ("x", "y", "z", "roll", "pitch", "yaw")) for arm in ARMS
}
"""Joints of each hand: position of the tool centre point [m], then roll, pitch, yaw [rad]."""

HANDS_READY = {
    "right": np.array([0.20, -0.27, 0.10, 0.10, np.radians(-50), np.radians(-60)]),
    "left": np.array([0.20, 0.27, 0.10, -0.10, np.radians(-50), np.radians(60)]),
}
"""Start and park pose of each hand (6,) [m, rad], above the near edge of the table."""

HAND_RANGE = np.array(
    [(-0.05, 0.66), (-0.60, 0.60), (0.01, 0.55), (-2.5, 2.5), (-1.35, 1.35), (-3.3, 3.3)]
)
"""Planning limits of a hand's joints (6, 2) [m, rad], inside the hard limits of the model."""

HAND_SPEEDS = np.array([1.1, 1.1, 1.1, 8.0, 8.0, 8.0])
"""Largest speeds of a hand's joints (6,) [m/s, rad/s]."""

POINTING_DOWN = {
    "right": np.diag([1.0, -1.0, -1.0]),
    "left": np.diag([-1.0, 1.0, -1.0]),
}
"""Rotation matrix (3, 3) of the tool at zero roll, pitch and yaw: palms face the person.

The tool of the left hand is rotated by 180 degrees about its z axis, so that -y points to the index
finger of either hand and one grasp of an upright handle suits both.
"""

UPPER_ARM = 0.31
"""Length from shoulder to elbow [m]."""
FOREARM = 0.27
"""Length from elbow to wrist [m]."""
WRIST = np.array([0.008, 0.0, -0.125])
"""Position of the wrist in the hand's frame (3,) [m]."""
SHOULDERS = {"right": np.array([-0.17, -0.19, 0.40]), "left": np.array([-0.17, 0.19, 0.40])}
"""Positions of the shoulders of an upright person (3,) [m]."""
HIPS = np.array([-0.47, 0.0, -0.10])
"""Point about which the torso leans over the table (3,) [m]."""
TORSO = 0.62
"""Length of the torso below the chest [m]."""
HEAD = {
    "neck": np.array([0.015, 0.0, 0.08]),
    "head": np.array([0.05, 0.0, 0.19]),
    "hair": np.array([0.025, 0.0, 0.215]),
}
"""Centres of the parts above the chest, relative to the chest (3,) [m]."""
_LONGEST = 0.96 * (UPPER_ARM + FOREARM)  # the person leans forward before an arm is straight


@dataclass(frozen=True)
class Appearance:
    """Colours of a person: red, green and blue, 0 to 1."""

    skin: tuple[float, float, float]
    """Hands and face."""
    sleeve: tuple[float, float, float]
    """Forearms and upper arms."""
    shirt: tuple[float, float, float]
    """Torso."""
    hair: tuple[float, float, float] = (0.16, 0.11, 0.08)
    """Hair."""


def wear(model: mujoco.MjModel, appearance: Appearance) -> None:
    """Write the colours of `appearance` into the person's materials."""
    for arm in ARMS:
        model.mat(f"{arm}_skin").rgba[:3] = appearance.skin
    for part in ("skin", "sleeve", "shirt", "hair"):
        model.mat(f"person_{part}").rgba[:3] = getattr(appearance, part)


def hand_spec(arm: str) -> mujoco.MjSpec:
    """Return the model of one hand; the visible shapes of the left hand are mirrored."""
    spec = mujoco.MjSpec.from_file(str(assets_folder() / "person" / "hand.xml"))
    set_contacts(spec, arm)
    if arm == "left":
        for geom in spec.geoms:
            geom.pos[1] *= -1
            geom.fromto[[1, 4]] *= -1  # NaN, and stays NaN, for shapes without it
        spec.site("tcp").quat = (0, 0, 0, 1)
    return spec


def mount_person(spec: mujoco.MjSpec) -> None:
    """Add a person's body ("person_") and both hands ("right_", "left_") to the station."""
    body = mujoco.MjSpec.from_file(str(assets_folder() / "person" / "body.xml"))
    spec.attach(body, frame=spec.worldbody.add_frame(), prefix="person_")
    for arm in ARMS:
        spec.attach(hand_spec(arm), frame=spec.worldbody.add_frame(), prefix=f"{arm}_")


class Limbs:
    """Poses the visible arms, torso and head to match the hands."""

    def __init__(self, model: mujoco.MjModel) -> None:
        names = ("torso", "shoulders", *HEAD)
        self._trunk = {name: model.geom(f"person_{name}").id for name in names}
        self._hands = {arm: model.body(f"{arm}_hand").id for arm in ARMS}
        self._forearms = {arm: model.geom(f"person_{arm}_forearm").id for arm in ARMS}
        self._upper_arms = {arm: model.geom(f"person_{arm}_upper_arm").id for arm in ARMS}

    def paint(self, data: mujoco.MjData) -> None:
        """Write the poses of the limbs into `data`; the next physics step overwrites them."""
        rotations = {arm: data.xmat[hand].reshape(3, 3) for arm, hand in self._hands.items()}
        wrists = {
            arm: data.xpos[hand] + rotations[arm] @ WRIST for arm, hand in self._hands.items()
        }
        lean = lean_towards(wrists)
        for arm in ARMS:
            shoulder = SHOULDERS[arm] + lean
            elbow = elbow_of(arm, shoulder, wrists[arm], rotations[arm][:, 2])
            _lay(data, self._forearms[arm], wrists[arm], elbow)
            _lay(data, self._upper_arms[arm], elbow, shoulder)
        self._paint_trunk(data, lean)

    def _paint_trunk(self, data: mujoco.MjData, lean: np.ndarray) -> None:
        right, left = SHOULDERS["right"] + lean, SHOULDERS["left"] + lean
        chest = (right + left) / 2
        back = (HIPS - chest) / np.linalg.norm(HIPS - chest)
        _lay(data, self._trunk["torso"], chest + TORSO * back, chest)
        _lay(data, self._trunk["shoulders"], right, left)
        for name, offset in HEAD.items():
            data.geom_xpos[self._trunk[name]] = chest + offset


def lean_towards(wrists: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the shift of the shoulders (3,) [m] with which both arms reach their wrists.

    Args:
        wrists: Position (3,) [m] of each wrist by side.
    """
    lean = np.zeros(3)
    for arm, wrist in wrists.items():
        way = wrist - SHOULDERS[arm] - lean
        excess = np.linalg.norm(way) - _LONGEST
        if excess > 0:
            lean += way * excess / np.linalg.norm(way)
    return lean


def elbow_of(arm: str, shoulder: np.ndarray, wrist: np.ndarray, pointing: np.ndarray) -> np.ndarray:
    """Return the position of the elbow (3,) [m].

    Of the circle of solutions, it is the point where the wrist bends least, with a preference for
    the outside.

    Args:
        arm: "right" or "left".
        shoulder: Position of the shoulder (3,) [m].
        wrist: Position of the wrist (3,) [m].
        pointing: Direction of the hand, a unit vector (3,).
    """
    way = wrist - shoulder
    distance = float(np.clip(np.linalg.norm(way), UPPER_ARM - FOREARM, _LONGEST))
    along = way / np.linalg.norm(way)
    middle = (distance**2 + UPPER_ARM**2 - FOREARM**2) / (2 * distance)
    outwards = np.array([0.0, -0.6 if arm == "right" else 0.6, 0.0])
    aside = outwards - pointing
    aside = aside - along * (aside @ along)
    aside = aside / max(float(np.linalg.norm(aside)), 1e-6)
    return np.asarray(shoulder + along * middle + aside * np.sqrt(UPPER_ARM**2 - middle**2))


def _lay(data: mujoco.MjData, geom: int, start: np.ndarray, end: np.ndarray) -> None:
    """Place a shape midway between two points (3,) [m], its z axis along the line between them."""
    turn = np.zeros(4)
    mujoco.mju_quatZ2Vec(turn, end - start)
    mujoco.mju_quat2Mat(data.geom_xmat[geom], turn)
    data.geom_xpos[geom] = (start + end) / 2
