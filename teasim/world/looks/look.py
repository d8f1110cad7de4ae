"""How the station looks in one demonstration: light, colours, cloth, cameras, distractors.

Nothing here is physics: a demonstration has the same states, bit for bit, in every look.
"""

from dataclasses import dataclass
from functools import cache
from math import isfinite

import numpy as np

from teasim.common.errors import ConfigError
from teasim.constants import CAMERAS

Colour = tuple[float, float, float]
"""Red, green and blue, 0 to 1."""

LOOKS = ("fixed", "random")
"""How looks vary between demonstrations: not at all, or at random."""
LIGHT_BRIGHTNESS = (0.6, 1.1)
"""Range of the factor on the lamp's brightness in the fixed look."""
LIGHT_AMBIENT = (0.75, 1.05)
"""Range of the factor on the ambient light in the fixed look."""
LIGHT_TINGE = 0.08
"""Largest relative change of a colour channel of the lamp: warm or cold light."""
LIGHT_LEAN = np.radians(12)
"""Largest change of the lamp's elevation; it turns freely about the vertical [rad]."""
SHADE = (0.88, 1.1)
"""Range of the factor on the colour of a table, a cloth, the ground or the walls."""
TINT = (0.75, 1.2)
"""Range of the factor on each colour channel of a thing."""
CAMERA_OFFSET = 0.02
"""Largest shift of a camera along each axis [m]."""
CAMERA_TURN = np.radians(2)
"""Largest turn of a camera about each axis [rad]."""
CAMERA_ZOOM = (0.96, 1.04)
"""Range of the factor on a camera's field of view."""
MOST_DISTRACTORS = 3
"""Largest number of distractors."""

TABLES: tuple[Colour, ...] = (
    (0.64, 0.53, 0.42),
    (0.44, 0.32, 0.23),
    (0.70, 0.61, 0.49),
    (0.55, 0.56, 0.58),
    (0.72, 0.71, 0.68),
    (0.35, 0.38, 0.42),
)
"""Colours of tables."""
CLOTHS: tuple[tuple[Colour, Colour], ...] = (
    ((0.72, 0.69, 0.64), (0.58, 0.32, 0.30)),
    ((0.70, 0.72, 0.74), (0.38, 0.46, 0.60)),
    ((0.68, 0.70, 0.62), (0.42, 0.52, 0.40)),
    ((0.42, 0.44, 0.48), (0.58, 0.60, 0.62)),
)
"""Colours of cloths and of their stripes."""
GROUNDS: tuple[Colour, ...] = ((0.50, 0.51, 0.53), (0.46, 0.40, 0.34), (0.62, 0.61, 0.58))
"""Colours of the ground."""
WALLS: tuple[Colour, ...] = ((0.70, 0.70, 0.68), (0.58, 0.64, 0.70), (0.68, 0.62, 0.52))
"""Colours of walls."""
PATTERNS = ("plain", "stripes", "check")
"""Patterns of cloths."""
TINTED = ("kettle", "cup", "milk_jug", "sugar_pot", "tea_bag_holder", "spoon_holder")
"""Things whose colour may change."""


@dataclass(frozen=True)
class Extent:
    """Size of a distractor."""

    radius: float
    """Largest distance of a point of it from its place, on the table [m]."""
    height: float
    """Height [m]."""


@dataclass(frozen=True)
class Zone:
    """Part of the table over which neither arm nor anything carried passes."""

    x: tuple[float, float]
    """From and to, towards the front of the robot [m]."""
    y: tuple[float, float]
    """From and to, towards the robot's left [m]."""
    clearance: float
    """Largest height of a distractor here: a higher one would hide the task [m]."""

    def fits(self, extent: Extent) -> bool:
        """Whether a distractor of this size fits in."""
        width = min(self.x[1] - self.x[0], self.y[1] - self.y[0])
        return extent.height <= self.clearance and 2 * extent.radius <= width


DISTRACTORS = {
    "plate": Extent(0.055, 0.011),
    "bottle": Extent(0.031, 0.185),
    "book": Extent(0.059, 0.022),
    "plant": Extent(0.041, 0.130),
    "box": Extent(0.049, 0.071),
}
"""Sizes of all distractors by name."""
ZONES = (
    Zone((0.62, 0.74), (0.24, 0.60), 0.03),
    Zone((0.60, 0.74), (-0.60, -0.14), 0.19),
    Zone((-0.29, -0.13), (-0.60, -0.30), 0.19),
    Zone((-0.29, -0.15), (0.30, 0.60), 0.19),
)
"""The front rim left and right of the middle, and the corners behind the robot."""


def _check_colour(what: str, colour: Colour | None) -> None:
    if colour is not None and not all(isfinite(c) and 0 <= c <= 1 for c in colour):
        raise ConfigError(f"The colour of the {what} is {colour}; choose three values of 0 to 1.")


def _check_name(what: str, name: str, names: tuple[str, ...]) -> None:
    if name not in names:
        raise ConfigError(f"Unknown {what} '{name}'; choose {', '.join(names)}.")


@dataclass(frozen=True)
class Light:
    """The lamp and the ambient light."""

    brightness: float = 1.0
    """Factor on the lamp."""
    ambient: float = 1.0
    """Factor on the ambient light."""
    colour: Colour = (1.0, 1.0, 1.0)
    """Factor on each channel of the lamp."""
    turn: float = 0.0
    """The lamp is turned about the vertical [rad]."""
    lean: float = 0.0
    """The lamp is lowered by this angle [rad]."""


@dataclass(frozen=True)
class Cloth:
    """A cloth on the table."""

    pattern: str = "plain"
    """One of `PATTERNS`."""
    colour: Colour = CLOTHS[0][0]
    """Colour of the cloth."""
    stripe: Colour = CLOTHS[0][1]
    """Colour of its stripes."""

    def __post_init__(self) -> None:
        _check_name("pattern", self.pattern, PATTERNS)
        _check_colour("cloth", self.colour)
        _check_colour("stripes", self.stripe)


@dataclass(frozen=True)
class Tint:
    """Another colour of a thing."""

    name: str
    """One of `TINTED`."""
    factor: Colour
    """Factor on each channel of its colours."""

    def __post_init__(self) -> None:
        _check_name("thing to tint", self.name, TINTED)


@dataclass(frozen=True)
class CameraShift:
    """A small displacement of a camera."""

    camera: str
    """One of `CAMERAS`."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Shift along the world's axes [m]."""
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Turn, as a rotation vector in the camera's own axes [rad]."""
    zoom: float = 1.0
    """Factor on its field of view."""

    def __post_init__(self) -> None:
        _check_name("camera", self.camera, CAMERAS)


@dataclass(frozen=True)
class Distractor:
    """A thing in the picture that the task does not need; nothing can touch it."""

    name: str
    """One of `DISTRACTORS`."""
    x: float
    """Place towards the front of the robot [m]."""
    y: float
    """Place towards the robot's left [m]."""
    yaw: float = 0.0
    """Turn about the vertical [rad]."""
    colour: Colour | None = None
    """Colour of its main part; None keeps its own colour."""

    def __post_init__(self) -> None:
        _check_name("distractor", self.name, tuple(DISTRACTORS))
        _check_colour(self.name, self.colour)


@dataclass(frozen=True)
class Look:
    """Everything about the pictures of a demonstration that is not physics.

    The defaults are the station as defined in `scene.xml`.
    """

    light: Light = Light()
    """The light."""
    table: Colour | None = None
    """Colour of the table; None keeps the colour of the scene, as in the fields below."""
    cloth: Cloth | None = None
    """Cloth on the table; None for a bare table."""
    ground: Colour | None = None
    """Colour of the ground."""
    wall: Colour | None = None
    """Colour of the walls; None for no walls, only sky."""
    tints: tuple[Tint, ...] = ()
    """Changed colours of things."""
    cameras: tuple[CameraShift, ...] = ()
    """Displaced cameras."""
    distractors: tuple[Distractor, ...] = ()
    """Distractors, each at most once."""

    def __post_init__(self) -> None:
        for what in ("table", "ground", "wall"):
            _check_colour(what, getattr(self, what))
        named = {
            "tint": [tint.name for tint in self.tints],
            "camera": [shift.camera for shift in self.cameras],
            "distractor": [thing.name for thing in self.distractors],
        }
        for what, names in named.items():
            for name in names:
                if names.count(name) > 1:
                    raise ConfigError(f"The {what} '{name}' is given twice; give it once.")


@cache
def fixed_look() -> Look:
    """Return the look of the scene as defined."""
    return Look()


def draw_look(kind: str, rng: np.random.Generator) -> Look:
    """Return the fixed look, or a random one.

    Raises:
        ConfigError: `kind` is not one of `LOOKS`.
    """
    return sample_look(rng) if check_look_kind(kind) == "random" else fixed_look()


def check_look_kind(kind: str) -> str:
    """Return `kind`.

    Raises:
        ConfigError: it is not one of `LOOKS`.
    """
    if kind not in LOOKS:
        raise ConfigError(f"Unknown look '{kind}'; choose {', '.join(LOOKS)}.")
    return kind


def sample_look(rng: np.random.Generator) -> Look:
    """Draw every part of a look uniformly from the ranges and lists of this module."""
    return Look(
        light=_sample_light(rng),
        table=_shade(rng, _one_of(rng, TABLES)),
        cloth=_sample_cloth(rng),
        ground=_shade(rng, _one_of(rng, GROUNDS)),
        wall=_shade(rng, _one_of(rng, WALLS)) if rng.random() < 0.7 else None,
        tints=tuple(Tint(name, _triple(rng, *TINT)) for name in TINTED),
        cameras=tuple(_sample_shift(rng, camera) for camera in CAMERAS),
        distractors=_sample_distractors(rng),
    )


def _sample_light(rng: np.random.Generator) -> Light:
    return Light(
        brightness=float(rng.uniform(*LIGHT_BRIGHTNESS)),
        ambient=float(rng.uniform(*LIGHT_AMBIENT)),
        colour=_triple(rng, 1 - LIGHT_TINGE, 1 + LIGHT_TINGE),
        turn=float(rng.uniform(-np.pi, np.pi)),
        lean=float(rng.uniform(-LIGHT_LEAN, LIGHT_LEAN)),
    )


def _sample_cloth(rng: np.random.Generator) -> Cloth | None:
    """Draw a cloth for half of the tables."""
    if rng.random() < 0.5:
        return None
    colour, stripe = CLOTHS[rng.integers(len(CLOTHS))]
    pattern = PATTERNS[rng.integers(len(PATTERNS))]
    return Cloth(pattern, _shade(rng, colour), _shade(rng, stripe))


def _sample_shift(rng: np.random.Generator, camera: str) -> CameraShift:
    return CameraShift(
        camera,
        _triple(rng, -CAMERA_OFFSET, CAMERA_OFFSET),
        _triple(rng, -CAMERA_TURN, CAMERA_TURN),
        float(rng.uniform(*CAMERA_ZOOM)),
    )


def _sample_distractors(rng: np.random.Generator) -> tuple[Distractor, ...]:
    """Draw distractors in the zones they fit in; one that would overlap another is left out."""
    wanted = rng.permutation(tuple(DISTRACTORS))[: rng.integers(MOST_DISTRACTORS + 1)]
    placed: list[Distractor] = []
    for name in map(str, wanted):
        thing = _sample_distractor(rng, name)
        if all(_apart(thing, other) for other in placed):
            placed.append(thing)
    return tuple(placed)


def _sample_distractor(rng: np.random.Generator, name: str) -> Distractor:
    extent = DISTRACTORS[name]
    zones = [zone for zone in ZONES if zone.fits(extent)]
    zone = zones[rng.integers(len(zones))]
    x, y = (float(rng.uniform(a + extent.radius, b - extent.radius)) for a, b in (zone.x, zone.y))
    return Distractor(name, x, y, float(rng.uniform(-np.pi, np.pi)), _triple(rng, 0.2, 0.7))


def _apart(one: Distractor, other: Distractor) -> bool:
    gap = DISTRACTORS[one.name].radius + DISTRACTORS[other.name].radius
    return bool(np.hypot(one.x - other.x, one.y - other.y) > gap)


def _one_of(rng: np.random.Generator, colours: tuple[Colour, ...]) -> Colour:
    return colours[rng.integers(len(colours))]


def _shade(rng: np.random.Generator, colour: Colour) -> Colour:
    factor = float(rng.uniform(*SHADE))
    red, green, blue = (channel * factor for channel in colour)
    return red, green, blue


def _triple(rng: np.random.Generator, low: float, high: float) -> Colour:
    red, green, blue = (float(value) for value in rng.uniform(low, high, size=3))
    return red, green, blue
