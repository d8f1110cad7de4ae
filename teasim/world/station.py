"""Composition of the tea-making station: where things stand and how far they may be moved."""

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
    """Pose of an upright thing on the table."""

    x: float
    """Position towards the front of the robot [m]."""
    y: float
    """Position towards the robot's left [m]."""
    z: float = 0.0
    """Height of its underside [m]; the table top is 0."""
    yaw: float = 0.0
    """Turn about the vertical [rad]."""
    tilt: float = 0.0
    """Lean about its own y axis after the turn [rad]."""

    @property
    def quaternion(self) -> np.ndarray:
        """Orientation (4,), wxyz."""
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
"""Height of the hob's top, where kettle and knob stand [m]."""

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
"""Layout the skills were designed for; the tea bag and the spoon stand in their holders."""

POSITION_RANGE = 0.03
"""Things are moved at most this far from their nominal place, in x and in y [m]."""
YAW_RANGE = np.radians(10)
"""Things are turned at most this far from their nominal yaw [rad]."""
KNOB_RANGE = 0.015
"""The knob is moved at most this far, and never turned [m]."""
VESSEL_GAP = 0.18
"""Sugar pot and milk jug stand at least this far apart, for the hand at the jug's handle [m]."""

IN_HOLDER = {"tea_bag": ("tea_bag_holder", 0.001, 0.0), "spoon": ("spoon_holder", 0.002, 0.15)}
"""What stands in which holder: holder, height [m], lean [rad]."""

FREE_BODIES = ("kettle", "cup", "milk_jug", "sugar_pot", "tea_bag", "spoon")
"""Everything that can be carried away."""

_FIXED_BODIES = ("knob", "tea_bag_holder", "spoon_holder")


@dataclass(frozen=True)
class Layout:
    """Where everything stands at the start of an episode."""

    placements: Mapping[str, Placement]
    """One placement per name in `NOMINAL`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "placements", MappingProxyType(dict(self.placements)))

    def __getitem__(self, name: str) -> Placement:
        """Placement of a free body or of a holder."""
        if name in IN_HOLDER:
            holder, height, lean = IN_HOLDER[name]
            at = self.placements[holder]
            return Placement(at.x, at.y, height, at.yaw, lean)
        return self.placements[name]


def nominal_layout() -> Layout:
    """Everything in its nominal place."""
    return Layout(NOMINAL)


def sample_layout(rng: np.random.Generator) -> Layout:
    """Everything moved and turned uniformly within the stated ranges, hands fitting between."""
    while True:
        placements = {name: _moved(name, at, rng) for name, at in NOMINAL.items()}
        if placements["sugar_pot"].y - placements["milk_jug"].y >= VESSEL_GAP:
            return Layout(placements)


def draw_layout(rng: np.random.Generator, *, randomize: bool) -> Layout:
    """A random layout, or the nominal one, for which nothing is drawn."""
    return sample_layout(rng) if randomize else nominal_layout()


def _moved(name: str, at: Placement, rng: np.random.Generator) -> Placement:
    reach, turn = (KNOB_RANGE, 0.0) if name == "knob" else (POSITION_RANGE, YAW_RANGE)
    dx, dy = rng.uniform(-reach, reach, size=2)
    return Placement(at.x + dx, at.y + dy, at.z, at.yaw + rng.uniform(-turn, turn))


def station_spec(embodiment: str = "yumi") -> mujoco.MjSpec:
    """Station with somebody to work at it and props at their nominal places.

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
    """Compiled station; every caller gets a copy of its own, since layouts are written into it.

    Raises:
        ConfigError: there is no such embodiment.
    """
    return copy.copy(_compiled(embodiment))


def body_name(name: str) -> str:
    """Name in the model of a station body: props carry their own name as a prefix."""
    return name if name == "knob" else f"{name}/{name}"


def place(model: mujoco.MjModel, data: mujoco.MjData, layout: Layout) -> None:
    """Write a layout into the free joints and the fixed bodies."""
    for name in _FIXED_BODIES:
        body = model.body(body_name(name))
        at = layout[name]
        body.pos, body.quat = (at.x, at.y, at.z), at.quaternion
    for name in FREE_BODIES:
        at = layout[name]
        data.joint(body_name(name)).qpos = [at.x, at.y, at.z, *at.quaternion]
