"""How the station looks in one demonstration: light, colours, cloth, cameras, things around it.

Nothing here is physics: two looks of one demonstration have the same states, bit for bit.
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
"""How the pictures of several demonstrations vary."""
LIGHT_BRIGHTNESS = (0.6, 1.1)
"""The lamp shines this many times as brightly as in the fixed look."""
LIGHT_AMBIENT = (0.75, 1.05)
"""So does the light that comes from everywhere."""
LIGHT_TINGE = 0.08
"""A channel of the lamp differs at most by this share: warm or cold light."""
LIGHT_LEAN = np.radians(12)
"""The lamp stands at most this much higher or lower; it turns freely about the vertical [rad]."""
SHADE = (0.88, 1.1)
"""A table's, cloth's, floor's or wall's colour is multiplied by a factor in this range."""
TINT = (0.75, 1.2)
"""Every channel of a thing's colour is multiplied by a factor in this range."""
CAMERA_OFFSET = 0.02
"""A camera is moved at most this far along each axis [m]."""
CAMERA_TURN = np.radians(2)
"""A camera is turned at most this far about each axis [rad]."""
CAMERA_ZOOM = (0.96, 1.04)
"""A camera's field of view is multiplied by a factor in this range."""
MOST_DISTRACTORS = 3
"""At most this many things stand around that have no use."""

TABLES: tuple[Colour, ...] = (
    (0.64, 0.53, 0.42),
    (0.44, 0.32, 0.23),
    (0.70, 0.61, 0.49),
    (0.55, 0.56, 0.58),
    (0.72, 0.71, 0.68),
    (0.35, 0.38, 0.42),
)
CLOTHS: tuple[tuple[Colour, Colour], ...] = (
    ((0.72, 0.69, 0.64), (0.58, 0.32, 0.30)),
    ((0.70, 0.72, 0.74), (0.38, 0.46, 0.60)),
    ((0.68, 0.70, 0.62), (0.42, 0.52, 0.40)),
    ((0.42, 0.44, 0.48), (0.58, 0.60, 0.62)),
)
"""Colours of cloths and of their stripes."""
FLOORS: tuple[Colour, ...] = ((0.50, 0.51, 0.53), (0.46, 0.40, 0.34), (0.62, 0.61, 0.58))
WALLS: tuple[Colour, ...] = ((0.70, 0.70, 0.68), (0.58, 0.64, 0.70), (0.68, 0.62, 0.52))
PATTERNS = ("plain", "stripes", "check")
TINTED = ("kettle", "cup", "milk_jug", "sugar_pot", "tea_bag_holder", "spoon_holder")
"""Things whose colour may change."""


@dataclass(frozen=True)
class Kind:
    """A thing without a use."""

    radius: float
    """It stays within this distance of its place [m]."""
    height: float
    """Height [m]."""


@dataclass(frozen=True)
class Zone:
    """Part of the table where neither arm nor anything carried passes."""

    x: tuple[float, float]
    """From and to, towards the front of the robot [m]."""
    y: tuple[float, float]
    """From and to, towards the robot's left [m]."""
    clearance: float
    """Things that stand here are at most this high, or they would hide what is done [m]."""

    def room(self, kind: Kind) -> bool:
        """Whether the thing fits."""
        width = min(self.x[1] - self.x[0], self.y[1] - self.y[0])
        return kind.height <= self.clearance and 2 * kind.radius <= width


DISTRACTORS = {
    "plate": Kind(0.055, 0.011),
    "bottle": Kind(0.031, 0.185),
    "book": Kind(0.059, 0.022),
    "plant": Kind(0.041, 0.130),
    "box": Kind(0.049, 0.071),
}
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
    """The lamp and the light from everywhere."""

    brightness: float = 1.0
    """Factor on the lamp."""
    ambient: float = 1.0
    """Factor on the light from everywhere."""
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
    """A camera that stands a little elsewhere."""

    camera: str
    """One of `CAMERAS`."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Moved by this much, in the world's axes [m]."""
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Turned by this much, as a rotation vector in the camera's own axes [rad]."""
    zoom: float = 1.0
    """Factor on its field of view."""

    def __post_init__(self) -> None:
        _check_name("camera", self.camera, CAMERAS)


@dataclass(frozen=True)
class Distractor:
    """A thing without a use that stands in the picture; nothing can touch it."""

    name: str
    """One of `DISTRACTORS`."""
    x: float
    """Place towards the front of the robot [m]."""
    y: float
    """Place towards the robot's left [m]."""
    yaw: float = 0.0
    """Turn about the vertical [rad]."""
    colour: Colour | None = None
    """Colour of its main part; None leaves it its own."""

    def __post_init__(self) -> None:
        _check_name("distractor", self.name, tuple(DISTRACTORS))
        _check_colour(self.name, self.colour)


@dataclass(frozen=True)
class Look:
    """Everything about the pictures of a demonstration that is not physics.

    Without arguments it is the station as `scene.xml` has it.
    """

    light: Light = Light()
    """The light."""
    table: Colour | None = None
    """Colour of the table; None is that of the scene, as for those below."""
    cloth: Cloth | None = None
    """Cloth on the table; None is none."""
    floor: Colour | None = None
    """Colour of the floor."""
    wall: Colour | None = None
    """Colour of the walls; None is no walls, but the sky."""
    tints: tuple[Tint, ...] = ()
    """Things of another colour."""
    cameras: tuple[CameraShift, ...] = ()
    """Cameras that stand elsewhere."""
    distractors: tuple[Distractor, ...] = ()
    """Things that stand around, each at most once."""

    def __post_init__(self) -> None:
        for what in ("table", "floor", "wall"):
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
    """Return the look of the scene as it is."""
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
        floor=_shade(rng, _one_of(rng, FLOORS)),
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
    """Half the tables are bare."""
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
    """Things where there is room; one that would stand in another is left out."""
    wanted = rng.permutation(tuple(DISTRACTORS))[: rng.integers(MOST_DISTRACTORS + 1)]
    placed: list[Distractor] = []
    for name in map(str, wanted):
        thing = _sample_distractor(rng, name)
        if all(_apart(thing, other) for other in placed):
            placed.append(thing)
    return tuple(placed)


def _sample_distractor(rng: np.random.Generator, name: str) -> Distractor:
    kind = DISTRACTORS[name]
    zones = [zone for zone in ZONES if zone.room(kind)]
    zone = zones[rng.integers(len(zones))]
    x, y = (float(rng.uniform(a + kind.radius, b - kind.radius)) for a, b in (zone.x, zone.y))
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
