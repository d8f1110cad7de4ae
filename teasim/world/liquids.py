"""Water, milk, sugar and tea as levels: they flow when a vessel is tilted, and can be seen."""

from dataclasses import dataclass
from functools import cache

import mujoco
import numpy as np

from teasim.world.state import Saved
from teasim.world.station import body_name

FLOW_LIMIT = 40.0
"""Largest outflow of a spout [ml/s]."""
FLOW_TIME = 0.15
"""Time constant of the outflow once the level is above the lip [s]."""
CATCH_RADIUS = 0.034
"""A stream lands in the cup when the spout is this near to the cup's axis [m]."""
RIM_HEIGHT = 0.072
"""Height of the cup's rim above its underside [m]."""
CUP_RADIUS = 0.0355
"""Inner radius of the cup [m]."""
CUP_FLOOR = 0.006
"""Thickness of the cup's base [m]."""
BREW_TIME = 8.0
"""Time constant of the tea getting stronger while nobody stirs [s]."""
STIR_TIME = 1.0
"""Time constant of tea, milk and sugar mixing while the spoon moves in the liquid [s]."""


@dataclass(frozen=True)
class Vessel:
    """A vessel that can be poured from."""

    content: str
    """What is in it."""
    filling: float
    """Amount at the start [ml, or g of sugar]."""
    radius: float
    """Inner radius [m]."""
    height: float
    """Inner height [m]."""


VESSELS = {
    "kettle": Vessel("water", 100.0, 0.039, 0.072),
    "milk_jug": Vessel("milk", 50.0, 0.023, 0.057),
    "sugar_pot": Vessel("sugar", 25.0, 0.023, 0.049),
}
CONTENTS = tuple(vessel.content for vessel in VESSELS.values())
_UPRIGHT = np.cos(np.radians(10))

_COLOURS = {"water": (0.62, 0.76, 0.88), "tea": (0.46, 0.19, 0.05), "milk": (0.97, 0.94, 0.87)}
_PUDDLES = {"water": (0.45, 0.62, 0.78), "milk": (0.95, 0.93, 0.88), "sugar": (0.97, 0.97, 0.97)}
_STREAMS = {
    "water": (0.45, 0.70, 0.95, 0.9),
    "milk": (0.98, 0.97, 0.92, 1.0),
    "sugar": (0.98, 0.98, 0.98, 1.0),
}


@dataclass(frozen=True)
class Stream:
    """A stream in the air, for the eye only."""

    start: np.ndarray
    """Spout (3,) [m]."""
    end: np.ndarray
    """Where it lands (3,) [m]."""
    rgba: tuple[float, float, float, float]
    """Colour."""


@cache
def _held_table(radius: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Volume a tilted cylinder can hold, tabulated over the tilt in 1-degree steps [ml]."""
    x = np.linspace(-radius, radius, 401)
    width = 2 * np.sqrt(np.maximum(radius**2 - x**2, 0))
    tilts = np.radians(np.arange(0, 90))
    depth = np.clip(height - np.outer(np.tan(tilts), radius - x), 0, height)
    volume = np.trapezoid(depth * width, x, axis=1) * 1e6
    return np.append(tilts, np.pi / 2), np.append(volume, 0.0)


def held_volume(vessel: Vessel, tilt: float) -> float:
    """Largest volume [ml] the vessel holds when tilted by `tilt` [rad] towards its spout."""
    tilts, volumes = _held_table(vessel.radius, vessel.height)
    return float(np.interp(tilt, tilts, volumes))


class Liquids(Saved):
    """Amounts in the vessels, in the cup and on the table.

    Masses of the bodies stay what they are: the 25 to 100 g that move are within what the grasps
    hold, and changing a body's mass in mid-contact makes light vessels jump.
    """

    SAVED = ("amounts", "cup", "spilled", "spill_place", "tea", "mixed", "streams")

    def __init__(self, model: mujoco.MjModel) -> None:
        self._vessel_bodies = {name: model.body(body_name(name)).id for name in VESSELS}
        self._spouts = {name: model.site(f"{name}/spout").id for name in VESSELS}
        self._cup = model.body(body_name("cup")).id
        painted = [*(f"{name}/content" for name in VESSELS), "cup/content", "cup/sugar", "spill"]
        self._painted = [model.geom(name).id for name in painted]
        self.reset()

    def reset(self) -> None:
        """Fill the vessels and empty the cup."""
        self.amounts = {name: vessel.filling for name, vessel in VESSELS.items()}
        self.cup = dict.fromkeys(CONTENTS, 0.0)
        self.spilled = dict.fromkeys(CONTENTS, 0.0)
        self.spill_place = np.zeros(2)
        self.tea = 0.0
        self.mixed = 0.0
        self.streams: tuple[Stream, ...] = ()

    @property
    def depth(self) -> float:
        """Depth of the liquid in the cup [m]."""
        return (self.cup["water"] + self.cup["milk"]) * 1e-6 / (np.pi * CUP_RADIUS**2)

    def update(self, data: mujoco.MjData, dt: float, *, brewing: bool, stirring: bool) -> None:
        """Let everything flow, brew and mix for `dt` seconds."""
        # What stands upright is not so full that it would run out.
        lean = data.xmat[:, 8]
        tilted = [name for name, body in self._vessel_bodies.items() if lean[body] <= _UPRIGHT]
        streams = [self._pour(name, data, dt) for name in tilted]
        self.streams = tuple(stream for stream in streams if stream is not None)
        if brewing and self.cup["water"] > 0:
            self.tea += (1 - self.tea) * dt / (STIR_TIME if stirring else BREW_TIME)
        if stirring:
            self.mixed += (1 - self.mixed) * dt / STIR_TIME

    def _pour(self, name: str, data: mujoco.MjData, dt: float) -> Stream | None:
        vessel = VESSELS[name]
        rotation = data.xmat[self._vessel_bodies[name]].reshape(3, 3)
        tilt = float(np.arccos(max(rotation[2, 2], -1.0)))
        above_lip = self.amounts[name] - held_volume(vessel, tilt)
        if above_lip <= 1e-9:
            return None
        amount = min(FLOW_LIMIT * dt, above_lip * min(dt / FLOW_TIME, 1.0))
        self.amounts[name] -= amount
        spout = data.site_xpos[self._spouts[name]].copy()
        over_spout = -rotation[2, 0] > abs(rotation[2, 1])
        if over_spout and self._caught(spout, data):
            self.cup[vessel.content] += amount
            end = np.array([*spout[:2], data.xpos[self._cup][2] + CUP_FLOOR + self.depth])
        else:
            self.spilled[vessel.content] += amount
            self.spill_place = spout[:2].copy()
            end = np.array([*spout[:2], 0.0])
        if amount < 0.02 * FLOW_LIMIT * dt:
            return None  # the last drops are not worth drawing
        return Stream(spout, end, _STREAMS[vessel.content])

    def _caught(self, spout: np.ndarray, data: mujoco.MjData) -> bool:
        upright = data.xmat[self._cup].reshape(3, 3)[2, 2] > np.cos(np.radians(20))
        offset = spout - data.xpos[self._cup]
        return bool(upright and offset[2] > RIM_HEIGHT and np.hypot(*offset[:2]) < CATCH_RADIUS)

    @property
    def colour(self) -> np.ndarray:
        """Colour of what is in the cup (3,)."""
        water, tea, milk = (np.array(_COLOURS[name]) for name in ("water", "tea", "milk"))
        brewed = water + (tea - water) * self.tea
        total = self.cup["water"] + self.cup["milk"]
        share = self.cup["milk"] / total if total > 0 else 0.0
        # Unstirred milk floats: one sees more of it than there is.
        whiteness = np.clip(share * (2.2 - self.mixed), 0, 1)
        return np.asarray(brewed + (milk - brewed) * whiteness)

    def paint(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Write levels and colours into the shapes that show them."""
        for name, vessel in VESSELS.items():
            level = self.amounts[name] * 1e-6 / (np.pi * vessel.radius**2)
            content = model.geom(f"{name}/content")
            content.pos[2] = 0.0035 + level
            content.rgba[3] = 1.0 if self.amounts[name] > 1 else 0.0
        self._paint_cup(model)
        self._paint_spill(model)
        # Where a shape is in the world is otherwise only found out by the next physics step.
        for geom in self._painted:
            body = model.geom_bodyid[geom]
            offset = data.xmat[body].reshape(3, 3) @ model.geom_pos[geom]
            data.geom_xpos[geom] = data.xpos[body] + offset

    def _paint_spill(self, model: mujoco.MjModel) -> None:
        spill = model.geom("spill")
        amounts = np.array(list(self.spilled.values()))
        amount = amounts.sum()
        thickness = 0.001 + 0.004 * self.spilled["sugar"] / max(amount, 1.0)  # sugar heaps up
        spill.pos[:2] = self.spill_place
        spill.size[0] = np.sqrt(max(amount, 0.01) * 1e-6 / (np.pi * thickness))
        colours = np.array([_PUDDLES[content] for content in self.spilled])
        spill.rgba[:3] = amounts @ colours / max(amount, 0.01)
        spill.rgba[3] = 0.85 if amount > 1 else 0.0

    def _paint_cup(self, model: mujoco.MjModel) -> None:
        content, sugar = model.geom("cup/content"), model.geom("cup/sugar")
        content.pos[2] = CUP_FLOOR + self.depth
        content.rgba[:3] = self.colour
        content.rgba[3] = 1.0 if self.depth > 0.0005 else 0.0
        heap = self.cup["sugar"] * (1 - self.mixed)
        sugar.size[0] = 0.012 + 0.020 * min(heap / 25.0, 1.0)
        sugar.pos[2] = CUP_FLOOR + 0.002
        sugar.rgba[3] = 1.0 if heap > 1 else 0.0
