"""A tool arm sets parts on a base plate and screws them on; one of two cameras follows it a bit.

Boxes in space are drawn in perspective, the farther ones first; lengths are in centimetres.
"""

from collections.abc import Sequence
from itertools import pairwise

import cv2
import numpy as np

from scenes.parts.drawing import Canvas, Colour, Film, Look, Point, along, table
from scenes.parts.people import Clutter, Daylight, colour_of
from scenes.scene import Scene

BACKGROUND = table(120, 160, (138, 132, 120), 9)
HOME, AIM = np.array([1.0, 3.0, 13.0]), np.array([0.0, 0.0, 0.0])
FOLLOWS = 0.25  # share of the arm's motion that the second camera makes
PARTS: dict[str, tuple[np.ndarray, np.ndarray, Colour]] = {
    "base": (np.array([0.0, 0.0, 0.4]), np.array([5.2, 3.6, 0.4]), (175, 180, 188)),
    "motor": (np.array([-2.8, 1.2, 2.0]), np.array([1.6, 1.6, 1.2]), (52, 54, 62)),
    "board": (np.array([2.6, 1.0, 1.1]), np.array([2.1, 2.0, 0.3]), (30, 120, 60)),
    "label": (np.array([-3.2, -2.4, 0.9]), np.array([1.7, 0.8, 0.1]), (240, 225, 90)),
    "magnet": (np.array([2.8, -2.5, 1.2]), np.array([1.4, 0.7, 0.5]), (60, 80, 200)),
    "cover": (np.array([0.0, 1.0, 3.4]), np.array([5.2, 2.4, 0.2]), (120, 160, 200)),
}
"""Where the middle of a part belongs, half its sides [cm], and its colour."""
STORES = {
    "base": np.array([-11.5, -4.0, 0.4]),
    "motor": np.array([-10.5, 5.5, 1.2]),
    "board": np.array([-4.5, 9.0, 0.3]),
    "label": np.array([10.5, -4.5, 0.1]),
    "magnet": np.array([11.0, 0.5, 0.5]),
    "cover": np.array([4.0, 9.5, 0.2]),
    "cable": np.array([11.0, 8.0, 0.4]),
    "driver": np.array([11.0, 4.0, 0.8]),
}
CABLE = np.array([[-1.2, 1.0, 2.4], [-0.4, -0.6, 3.0], [0.4, -0.8, 2.6], [1.2, 0.2, 1.6]])
CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
FACES = np.stack([np.insert(CORNERS, axis, 1, axis=1) for axis in range(3)])
"""(3, 4, 3) corners of a side, a front and the top of a cube."""
SHADES = np.array([[0.66], [0.82], [1.12]])  # brightness of these faces


class Eye:
    """A camera without a lens: it looks at a place from a place."""

    def __init__(self, place: Point, aim: Point, zoom: float) -> None:
        """Stand at `place` (3,) and look at `aim` (3,); `zoom` is in pixels per unit slope."""
        self.place = place
        ahead = (aim - place) / np.linalg.norm(aim - place)
        right = np.array([ahead[1], -ahead[0], 0]) / np.hypot(ahead[0], ahead[1])
        down = np.cross(ahead, right)
        middle = np.array([[80.0], [60.0]])
        self._rows = np.stack([zoom * right, zoom * down, ahead])
        self._rows[:2] += middle * ahead
        self._offset = self._rows @ place

    def see(self, points: np.ndarray) -> np.ndarray:
        """Return where points (..., 3) are in the picture (..., 2) [pixels]."""
        seen = points @ self._rows.T - self._offset
        return np.asarray(seen[..., :2] / np.maximum(seen[..., 2:], 1.0))

    def far(self, point: Point) -> float:
        """Return how far away a point is [cm]."""
        return float(np.linalg.norm(point - self.place))


class Assembly:
    """A base plate, parts, a screwdriver and an arm."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Lay the parts out at random around the middle."""
        self.stores = {
            name: place + [*rng.uniform(-1.0, 1.0, 2), 0] for name, place in STORES.items()
        }
        self.origin = np.array([*rng.normal(0, 0.3, 2), 0])
        self.where = {name: self.stores[name] for name in PARTS}
        self.screwed: dict[str, tuple[str, Point]] = {}
        self.cable: np.ndarray | None = None
        self.plugged = False
        self.driver: np.ndarray | None = None
        self.turned = 0.0
        self.paint = (215 + rng.integers(-15, 15), 120 + rng.integers(-30, 30), 40)
        self.stand = rng.normal(0, 0.5, 3)
        looks = {"front": Look(shake=0.2, drift=0.05), "wrist": Look(shake=0.5, light=0.12)}
        self.films = {name: Film(look, rng) for name, look in looks.items()}
        self.light = Daylight(0.1, rng)
        self.clutter = Clutter(np.array([[8.0, 110], [152, 112], [128, 116]]), 4, rng)
        self.rng = rng
        self.rest()

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        if step.startswith("fix_"):
            self._screw(step, share, works)
        elif step == "cable":
            self._plug(share, works)
        else:
            self._bring(step, share, works)

    def rest(self) -> None:
        """Stand."""
        self.hand = HOME + self.rng.normal(0, 0.05, 3)
        self.driver = None

    def _path(self, start: Point, goal: Point, share: float) -> int:
        up = np.array([0.0, 0.0, 6.0])
        stops = [HOME, start + up, start, start + up, goal + up, goal, goal + up, HOME]
        self.hand, leg = along(stops, share)
        return leg

    def _seat(self, name: str) -> Point:
        """Return where a part belongs; lower if the base plate is not there."""
        lacks = name != "base" and not self._moved("base")
        return np.asarray(PARTS[name][0] + self.origin - [0, 0, 0.8 * lacks])

    def _moved(self, name: str) -> bool:
        return not np.allclose(self.where[name], self.stores[name])

    def _bring(self, name: str, share: float, works: bool) -> None:
        top = np.array([0.0, 0.0, PARTS[name][1][2]])
        seat = self._seat(name)
        leg = self._path(self.stores[name] + top, seat + top, share)
        if works and leg >= 2:
            self.where[name] = self.hand - top if leg < 5 else seat

    def _plug(self, share: float, works: bool) -> None:
        leg = self._path(self.stores["cable"], CABLE[1] + self.origin, share)
        if works and leg >= 2:
            self.cable = self.hand if leg < 5 else None
            self.plugged = leg >= 5

    def _screw(self, step: str, share: float, works: bool) -> None:
        part = step.removeprefix("fix_")
        there = self._moved(part)
        seat = self._seat(part) + [0, 0, PARTS[part][1][2] * (1 if there else -1)]
        store, up = self.stores["driver"] + [0, 0, 3.6], np.array([0.0, 0.0, 3.6])
        over = seat + up + [0, 0, 4]
        stops = [HOME, store, over, seat + up, seat + up, over, store, HOME]
        self.hand, leg = along(stops, share)
        if 1 <= leg <= 5:
            self.driver = self.hand - up
        self.turned += 0.9 * (leg == 3)
        if works and leg >= 4:
            self.screwed[step] = (part if there else "base", seat)

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        follow = FOLLOWS * (self.hand - HOME)
        eyes = {
            "front": Eye(np.array([0.0, -22.0, 21.0]) + self.stand, AIM + [0, 1.4, 1], 165),
            "wrist": Eye(np.array([9.0, 7.0, 22.0]) + follow, AIM + 0.6 * follow * [1, 1, 0], 130),
        }
        return {name: self.films[name].take(self._draw(eye)) for name, eye in eyes.items()}

    def _draw(self, eye: Eye) -> np.ndarray:
        canvas = Canvas(BACKGROUND)
        self.clutter.draw(canvas)
        mat = (
            np.array([[-6.2, -4.6, 0], [6.2, -4.6, 0], [6.2, 4.6, 0], [-6.2, 4.6, 0]]) + self.origin
        )
        canvas.polygon(eye.see(mat), (72, 84, 96))
        tray = np.array([[8.6, 2, 0], [13.5, 2, 0], [13.5, 10, 0], [8.6, 10, 0]])
        canvas.polygon(eye.see(tray), (100, 92, 84))
        for name in sorted(PARTS, key=lambda name: (name != "base", -eye.far(self.where[name]))):
            if name != "cover":
                self._part(canvas, eye, name)
                self._screw_heads(canvas, eye, name)
        self._cable(canvas, eye)
        if self.driver is None:
            self._driver(canvas, eye, self.stores["driver"], np.array([0.0, 4.0, 0.0]))
        self._part(canvas, eye, "cover")
        if self.driver is not None:
            self._driver(canvas, eye, self.driver, np.array([0.0, 0.0, 4.0]))
        self._arm(canvas, eye)
        return self.light.fall(canvas.image)

    def _part(self, canvas: Canvas, eye: Eye, name: str) -> None:
        _, half, colour = PARTS[name]
        at = self.where[name]
        if name == "cover":
            clear = canvas.image.copy()
            self._solid(canvas, eye, at, half, colour)
            canvas.image = cv2.addWeighted(canvas.image, 0.62, clear, 0.38, 0)
            return
        self._solid(canvas, eye, at, half, colour)
        top = at + [0, 0, half[2]]
        if name == "motor":
            self._disc(canvas, eye, top, 1.3, (185, 110, 60))
        elif name == "board":
            for x, y in ((-1.2, 0.9), (0.2, -1.0), (1.2, 0.8)):
                self._solid(canvas, eye, top + [x, y, 0.2], (0.5, 0.5, 0.2), (28, 28, 30))
        elif name == "label":
            self._solid(canvas, eye, top + [0, 0, 0.02], (1.4, 0.2, 0.02), (190, 40, 40))
        elif name == "magnet":
            self._solid(canvas, eye, at + [0.7, 0, 0.05], (0.7, 0.7, 0.5), (210, 50, 45))

    def _solid(
        self,
        canvas: Canvas,
        eye: Eye,
        at: Point,
        half: Sequence[float] | np.ndarray,
        colour: Colour,
    ) -> None:
        """Draw the top and the two walls of a box that the camera sees."""
        near = np.array([*np.sign((eye.place - at)[:2]), 1.0])
        faces = eye.see(at + FACES * (near * half))
        colours = np.minimum(SHADES * np.array(colour), 255).astype(int).tolist()
        for face, shaded in zip(faces, colours, strict=True):
            canvas.polygon(face, shaded)

    def _disc(self, canvas: Canvas, eye: Eye, at: Point, radius: float, colour: Colour) -> None:
        turns = np.linspace(0, 2 * np.pi, 14)
        ring = np.stack([np.cos(turns), np.sin(turns), 0 * turns], axis=-1)
        canvas.polygon(eye.see(at + radius * ring), colour)

    def _screw_heads(self, canvas: Canvas, eye: Eye, part: str) -> None:
        """Draw the heads of the screws in a part."""
        for holder, at in self.screwed.values():
            if holder == part:
                self._disc(canvas, eye, at, 1.25, (50, 45, 40))
                self._disc(canvas, eye, at, 1.0, (235, 225, 190))
                ends = eye.see(at + np.array([[-0.7, -0.5, 0], [0.7, 0.5, 0]]))
                canvas.line(ends[0], ends[1], 1, (60, 50, 40))

    def _cable(self, canvas: Canvas, eye: Eye) -> None:
        if self.plugged:
            points = CABLE + self.origin
        else:
            middle = self.stores["cable"] if self.cable is None else self.cable
            points = middle + np.array(
                [[-1.6, 0.5, 0], [-0.5, -0.6, 0], [0.6, 0.6, 0], [1.6, 0, 0]]
            )
        seen = eye.see(points)
        for start, stop in pairwise(seen):
            canvas.line(start, stop, 3, (235, 130, 30))

    def _driver(self, canvas: Canvas, eye: Eye, tip: Point, way: Point) -> None:
        start, middle, stop = eye.see(np.stack([tip, tip + 0.4 * way, tip + way]))
        canvas.line(start, middle, 2, (190, 194, 200))
        canvas.line(middle, stop, 6, (190, 40, 45))
        aside = np.array([2 * np.cos(self.turned), 0.0])
        canvas.line(middle + aside, stop + aside, 1, (245, 240, 120))

    def _arm(self, canvas: Canvas, eye: Eye) -> None:
        shoulder = np.array([16.0, 17.0, 8.0])
        elbow = (self.hand + shoulder) / 2 + [3, 2, 9]
        wrist = self.hand + [0, 0, 3.5]
        places = eye.see(np.stack([shoulder, elbow, wrist, self.hand + [0, 0, 0.8]]))
        paint = colour_of(np.array(self.paint))
        for number, width in ((0, 10), (1, 7)):
            canvas.line(places[number], places[number + 1], width, paint)
        canvas.disc(places[1], 6, (70, 70, 76))
        canvas.line(places[2], places[3], 5, (58, 60, 66))
        for side in (-0.8, 0.8):
            ends = eye.see(self.hand + np.array([[side, 0, 0.9], [side, 0, -0.6]]))
            canvas.line(ends[0], ends[1], 2, (30, 30, 32))


SCENE = Scene(
    name="assembly",
    world=Assembly,
    steps=("base", "motor", "fix_motor", "board", "fix_board", "cable", "label", "cover"),
    spares=("magnet",),
    waits={
        "motor": ("base",),
        "board": ("base",),
        "label": ("base",),
        "fix_motor": ("motor",),
        "fix_board": ("board",),
        "cable": ("motor", "board"),
        "cover": ("fix_motor", "fix_board", "cable"),
    },
    optional=("label",),
    cameras=("front", "wrist"),
    seconds=2.8,
)
