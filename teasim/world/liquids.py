"""Water, milk, sugar and tea as levels: they flow when a vessel is tilted, and are drawn."""

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
"""Largest distance between spout and cup's axis at which a stream lands in the cup [m]."""
RIM_HEIGHT = 0.072
"""Height of the cup's rim above its underside [m]."""
CUP_RADIUS = 0.0355
"""Inner radius of the cup [m]."""
CUP_BASE = 0.006
"""Thickness of the cup's base [m]."""
BREW_TIME = 8.0
"""Time constant of the tea getting stronger while nobody stirs [s]."""
STIR_TIME = 1.0
"""Time constant of tea, milk and sugar mixing while the spoon moves in the liquid [s]."""
PUDDLE_HEIGHT = 0.0057
"""Height of a puddle's middle [m]: its mean is then 3.8 mm, which surface tension gives water at a
contact angle of 90 degrees, twice the capillary length of 2.7 mm times sin 45 degrees."""
HEAP_SLOPE = np.tan(np.radians(35))
"""Slope of heaped sugar: its angle of repose is about 35 degrees."""
SUGAR_DENSITY = 0.85
"""Bulk density of granulated sugar [g/ml]."""
LOBES = ((0.0, 0.0, 1.0), (0.62, 0.42, 0.60), (-0.70, 0.30, 0.55), (0.10, -0.72, 0.55))
"""Shape of a puddle: place (x, y) and radius of each lobe, in radii of the largest one."""


@dataclass(frozen=True)
class Vessel:
    """A vessel that can be poured from."""

    content: str
    """Name of the content."""
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
"""All vessels by name."""
CONTENTS = tuple(vessel.content for vessel in VESSELS.values())
"""Names of the contents, in the order of the vessels."""
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
    """A stream in the air; only pictures show it."""

    start: np.ndarray
    """Spout (3,) [m]."""
    end: np.ndarray
    """Where it lands (3,) [m]."""
    rgba: tuple[float, float, float, float]
    """Colour."""


@cache
def _held_table(radius: float, height: float) -> tuple[np.ndarray, np.ndarray]:
    """Return tilts in 1-degree steps [rad] and the volumes a cylinder holds at each [ml]."""
    x = np.linspace(-radius, radius, 401)
    width = 2 * np.sqrt(np.maximum(radius**2 - x**2, 0))
    tilts = np.radians(np.arange(0, 90))
    depth = np.clip(height - np.outer(np.tan(tilts), radius - x), 0, height)
    volume = np.trapezoid(depth * width, x, axis=1) * 1e6
    return np.append(tilts, np.pi / 2), np.append(volume, 0.0)


def held_volume(vessel: Vessel, tilt: float) -> float:
    """Return the largest volume [ml] the vessel holds at a `tilt` [rad] towards its spout."""
    tilts, volumes = _held_table(vessel.radius, vessel.height)
    return float(np.interp(tilt, tilts, volumes))


def puddle_shape(content: str, lobe: int) -> str:
    """Return the name of the shape, half an ellipsoid on table or hob, that shows a lobe."""
    return f"spill_{content}_{lobe}"


def puddle_size(content: str, amount: float) -> tuple[float, float]:
    """Return radius and height [m] of the largest lobe of a spilled amount [ml or g].

    The height of a liquid is given by surface tension, that of a heap by its slope: half an
    ellipsoid has a cone's volume at half the cone's height.
    """
    if content == "sugar":
        volume, slope = amount * 1e-6 / SUGAR_DENSITY, HEAP_SLOPE / 2
        radius = (volume / (_puddle_volume() * slope)) ** (1 / 3)
        return float(radius), float(radius * slope)
    return float(np.sqrt(amount * 1e-6 / (_puddle_volume() * PUDDLE_HEIGHT))), PUDDLE_HEIGHT


@cache
def _puddle_volume() -> float:
    """Return the volume of a puddle whose largest lobe has unit radius and unit height."""
    places = np.linspace(-1.6, 1.6, 801)
    x, y = np.meshgrid(places, places)
    lobes = [
        share * np.sqrt(np.maximum(1 - ((x - across) ** 2 + (y - along) ** 2) / share**2, 0))
        for across, along, share in LOBES
    ]
    return float(np.max(lobes, axis=0).sum() * (places[1] - places[0]) ** 2)


class Ground:
    """The surfaces that liquid lands on: the table's top at z = 0 and the hob's above it."""

    def __init__(self, model: mujoco.MjModel) -> None:
        hob = model.geom("hob")
        centre = model.body(hob.bodyid[0]).pos + hob.pos
        self._low, self._high = centre[:2] - hob.size[:2], centre[:2] + hob.size[:2]
        self._top = float(centre[2] + hob.size[2])

    def height(self, place: np.ndarray) -> float:
        """Return the height of the surface below a place (x, y, ...) [m]."""
        on_hob = (self._low <= place[:2]).all() and (place[:2] <= self._high).all()
        return self._top if on_hob else 0.0

    def landed(self, place: np.ndarray, radius: float) -> np.ndarray:
        """Return where a lobe of this `radius` [m] around `place` (2,) [m] lies (3,) [m].

        On the hob it keeps inside the edges, over which liquid would not hang.
        """
        height = self.height(place)
        if height:
            inset = np.minimum(radius, (self._high - self._low) / 2)
            place = np.clip(place, self._low + inset, self._high - inset)
        return np.append(place, height)


class Liquids(Saved):
    """Amounts in the vessels, in the cup, and on table and hob.

    The masses of the bodies do not change: the grasps hold the 25 to 100 g that move anyway, and a
    change of mass during a contact makes light vessels jump.
    """

    SAVED = ("amounts", "cup", "spilled", "puddles", "tea", "mixed", "streams")

    def __init__(self, model: mujoco.MjModel) -> None:
        self._vessel_bodies = {name: model.body(body_name(name)).id for name in VESSELS}
        self._spouts = {name: model.site(f"{name}/spout").id for name in VESSELS}
        self._cup = model.body(body_name("cup")).id
        self._ground = Ground(model)
        painted = [*(f"{name}/content" for name in VESSELS), "cup/content", "cup/sugar"]
        painted += [puddle_shape(name, lobe) for name in CONTENTS for lobe in range(len(LOBES))]
        self._painted = [model.geom(name).id for name in painted]
        self.reset()

    def reset(self) -> None:
        """Fill the vessels and empty the cup."""
        self.amounts = {name: vessel.filling for name, vessel in VESSELS.items()}
        """Amount in every vessel [ml or g]."""
        self.cup = dict.fromkeys(CONTENTS, 0.0)
        """Amount of every content in the cup [ml or g]."""
        self.spilled = dict.fromkeys(CONTENTS, 0.0)
        """Amount of every content on table and hob [ml or g]."""
        self.puddles = {content: np.zeros(2) for content in CONTENTS}
        """Where every content was spilled, on the average (2,) [m]."""
        self.tea = 0.0
        """Strength of the tea, 0 to 1."""
        self.mixed = 0.0
        """How well the content of the cup is mixed, 0 to 1."""
        self.streams: tuple[Stream, ...] = ()
        """Streams in the air now."""

    @property
    def depth(self) -> float:
        """Depth of the liquid in the cup [m]."""
        return (self.cup["water"] + self.cup["milk"]) * 1e-6 / (np.pi * CUP_RADIUS**2)

    def update(self, data: mujoco.MjData, dt: float, *, brewing: bool, stirring: bool) -> None:
        """Let everything flow, brew and mix for `dt` seconds."""
        # An upright vessel is never so full that it overflows.
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
            end = np.array([*spout[:2], data.xpos[self._cup][2] + CUP_BASE + self.depth])
        else:
            self.spilled[vessel.content] += amount
            share = amount / self.spilled[vessel.content]
            puddle = self.puddles[vessel.content]
            self.puddles[vessel.content] = puddle + share * (spout[:2] - puddle)
            end = np.array([*spout[:2], self._ground.height(spout)])
        if amount < 0.02 * FLOW_LIMIT * dt:
            return None  # the last drops are too few to be seen
        return Stream(spout, end, _STREAMS[vessel.content])

    def _caught(self, spout: np.ndarray, data: mujoco.MjData) -> bool:
        upright = data.xmat[self._cup].reshape(3, 3)[2, 2] > np.cos(np.radians(20))
        offset = spout - data.xpos[self._cup]
        return bool(upright and offset[2] > RIM_HEIGHT and np.hypot(*offset[:2]) < CATCH_RADIUS)

    @property
    def colour(self) -> np.ndarray:
        """Colour of the liquid in the cup (3,)."""
        water, tea, milk = (np.array(_COLOURS[name]) for name in ("water", "tea", "milk"))
        brewed = water + (tea - water) * self.tea
        total = self.cup["water"] + self.cup["milk"]
        share = self.cup["milk"] / total if total > 0 else 0.0
        # Unstirred milk floats and is seen more than its share.
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
        for name in CONTENTS:
            self._paint_puddle(model, name)
        # The places of shapes in the world would otherwise be updated by the next physics step.
        for geom in self._painted:
            body = model.geom_bodyid[geom]
            offset = data.xmat[body].reshape(3, 3) @ model.geom_pos[geom]
            data.geom_xpos[geom] = data.xpos[body] + offset

    def _paint_puddle(self, model: mujoco.MjModel, content: str) -> None:
        """Draw a content's puddle, or heap, with the volume that was spilled."""
        amount = self.spilled[content]
        radius, height = puddle_size(content, amount)
        for number, (x, y, share) in enumerate(LOBES):
            shape = model.geom(puddle_shape(content, number))
            place = self.puddles[content] + radius * np.array([x, y])
            shape.pos[:] = self._ground.landed(place, share * radius)
            shape.size[:] = (share * radius, share * radius, share * height)
            shape.rgba[:] = (*_PUDDLES[content], 1.0 if amount > 1 else 0.0)

    def _paint_cup(self, model: mujoco.MjModel) -> None:
        content, sugar = model.geom("cup/content"), model.geom("cup/sugar")
        content.pos[2] = CUP_BASE + self.depth
        content.rgba[:3] = self.colour
        content.rgba[3] = 1.0 if self.depth > 0.0005 else 0.0
        heap = self.cup["sugar"] * (1 - self.mixed)
        sugar.size[0] = 0.012 + 0.020 * min(heap / 25.0, 1.0)
        sugar.pos[2] = CUP_BASE + 0.002
        sugar.rgba[3] = 1.0 if heap > 1 else 0.0
