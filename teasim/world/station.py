"""Model of the tea-making station: nominal places of the objects and ranges of random layouts."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

import mujoco
import numpy as np

from teasim.constants import PHYSICS_TIMESTEP, assets_folder
from teasim.world.bodies.embodiments import find_embodiment
from teasim.world.grain import add_grain


@dataclass(frozen=True)
class Placement:
    """Pose of an upright object on the table."""

    x: float
    """Position along x, to the front of the robot [m]."""
    y: float
    """Position along y, to the robot's left [m]."""
    z: float = 0.0
    """Height of its underside [m]; the table top is 0."""
    yaw: float = 0.0
    """Rotation about the vertical [rad]."""
    tilt: float = 0.0
    """Rotation about its own y axis after the yaw [rad]."""

    @property
    def quaternion(self) -> np.ndarray:
        """Orientation as a quaternion (4,), wxyz."""
        turn, lean = self.yaw / 2, self.tilt / 2
        return np.array(
            [
                np.cos(turn) * np.cos(lean),
                -np.sin(turn) * np.sin(lean),
                np.cos(turn) * np.sin(lean),
                np.sin(turn) * np.cos(lean),
            ]
        )


HOB_HEIGHT = 0.04
"""Height of the hob's top, on which kettle and knob stand [m]."""

NOMINAL: Mapping[str, Placement] = MappingProxyType(
    {
        "knob": Placement(0.34, -0.43, HOB_HEIGHT),
        "kettle": Placement(0.46, -0.27, HOB_HEIGHT + 0.001, np.pi / 2),
        "cup": Placement(0.42, 0.00, 0.001),
        "milk_jug": Placement(0.38, 0.18, 0.001, -np.pi / 2),
        "sugar_pot": Placement(0.40, 0.38, 0.001, -np.pi / 2),
        "tea_bag_holder": Placement(0.54, 0.33),
        "spoon_holder": Placement(0.54, 0.18),
    }
)
"""Nominal layout; the tea bag and the spoon stand in their holders."""

POSITION_RANGE = 0.03
"""Largest random shift of an object along x and along y [m]."""
YAW_RANGE = np.radians(10)
"""Largest random change of an object's yaw [rad]."""
KNOB_RANGE = 0.015
"""Largest random shift of the knob along x and along y [m]; its yaw is fixed."""
VESSEL_GAP = 0.18
"""Smallest distance along y between sugar pot and milk jug [m]; the hand at the jug fits in."""

IN_HOLDER = {"tea_bag": ("tea_bag_holder", 0.001, 0.0), "spoon": ("spoon_holder", 0.002, 0.15)}
"""Holder of each object that stands in one, its height [m] and its tilt [rad]."""

FREE_BODIES = ("kettle", "cup", "milk_jug", "sugar_pot", "tea_bag", "spoon")
"""Objects that can be carried."""

_FIXED_BODIES = ("knob", "tea_bag_holder", "spoon_holder")


@dataclass(frozen=True)
class Layout:
    """Poses of all objects at the start of an episode."""

    placements: Mapping[str, Placement]
    """One placement per name in `NOMINAL`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "placements", MappingProxyType(dict(self.placements)))

    def __getitem__(self, name: str) -> Placement:
        """Return the placement of a free body, a holder or the knob."""
        if name in IN_HOLDER:
            holder, height, lean = IN_HOLDER[name]
            at = self.placements[holder]
            return Placement(at.x, at.y, height, at.yaw, lean)
        return self.placements[name]


def nominal_layout() -> Layout:
    """Return the layout with every object in its nominal place."""
    return Layout(NOMINAL)


def sample_layout(rng: np.random.Generator) -> Layout:
    """Draw a layout uniformly from the ranges above; one without `VESSEL_GAP` is redrawn."""
    while True:
        placements = {name: _moved(name, at, rng) for name, at in NOMINAL.items()}
        if placements["sugar_pot"].y - placements["milk_jug"].y >= VESSEL_GAP:
            return Layout(placements)


def draw_layout(rng: np.random.Generator, *, randomize: bool) -> Layout:
    """Return a random layout, or the nominal one, for which `rng` is not used."""
    return sample_layout(rng) if randomize else nominal_layout()


def _moved(name: str, at: Placement, rng: np.random.Generator) -> Placement:
    reach, turn = (KNOB_RANGE, 0.0) if name == "knob" else (POSITION_RANGE, YAW_RANGE)
    dx, dy = rng.uniform(-reach, reach, size=2)
    return Placement(at.x + dx, at.y + dy, at.z, at.yaw + rng.uniform(-turn, turn))


def station_spec(embodiment: str = "yumi") -> mujoco.MjSpec:
    """Return the station with an embodiment and all objects in their nominal places.

    Raises:
        ConfigError: there is no such embodiment.
    """
    folder = assets_folder()
    spec = mujoco.MjSpec.from_file(str(folder / "tea_station" / "scene.xml"))
    add_grain(spec)
    find_embodiment(embodiment).mount(spec)
    layout = nominal_layout()
    for name in (*FREE_BODIES, *_FIXED_BODIES[1:]):
        at = layout[name]
        prop = mujoco.MjSpec.from_file(str(folder / "tea_props" / f"{name}.xml"))
        frame = spec.worldbody.add_frame(pos=[at.x, at.y, at.z], quat=at.quaternion)
        spec.attach(prop, frame=frame, prefix=f"{name}/")
    option = spec.option
    option.timestep = PHYSICS_TIMESTEP
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = 10
    return spec


@cache
def _compiled(embodiment: str) -> mujoco.MjModel:
    return station_spec(embodiment).compile()


def station_model(embodiment: str = "yumi") -> mujoco.MjModel:
    """Return a new copy of the compiled station; layouts are written into it.

    Raises:
        ConfigError: there is no such embodiment.
    """
    return copy.copy(_compiled(embodiment))


def body_name(name: str) -> str:
    """Return the name of an object's body in the model; props have their own name as a prefix."""
    return name if name == "knob" else f"{name}/{name}"


def place(model: mujoco.MjModel, data: mujoco.MjData, layout: Layout) -> None:
    """Write a layout into the free joints and into the poses of the fixed bodies."""
    for name in _FIXED_BODIES:
        body = model.body(body_name(name))
        at = layout[name]
        body.pos, body.quat = (at.x, at.y, at.z), at.quaternion
    for name in FREE_BODIES:
        at = layout[name]
        data.joint(body_name(name)).qpos = [at.x, at.y, at.z, *at.quaternion]
