"""A robot on a rail services machines in a hall, filmed from the side by a swaying camera."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, Point, along, smooth
from scenes.parts.people import colour_of
from scenes.scene import Scene

GROUND, BEHIND = 100, (128, 134, 140)
RAIL = 96.0
PLACES = {
    "filter": 22.0,
    "oil": 50.0,
    "wipe": 78.0,
    "belt": 106.0,
    "lamp": 132.0,
    "sign": 150.0,
    "reset": 64.0,
}
"""Where along the rail each thing is done [pixels]."""
HEIGHTS = {
    "filter": 52.0,
    "oil": 62.0,
    "wipe": 46.0,
    "belt": 58.0,
    "lamp": 26.0,
    "sign": 40.0,
    "reset": 74.0,
}
DOCK = 8.0


class Service:
    """A row of machines, and a robot that drives along them."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Put things where they are in this video."""
        self.shift = {name: rng.normal(0, 2, 2) for name in PLACES}
        self.level, self.stain, self.sag = 0.15, 1.0, 1.0
        self.fresh = self.lit = self.hung = self.green = False
        self.base, self.arm = DOCK, np.array([DOCK, 70.0])
        self.carried: str | None = None
        self.paint = rng.integers(60, 200, (3, 3))
        self.dirt = rng.normal(0, 1, (16, 2))
        self.hum = 0.0
        self.film = Film(Look(light=0.15, drift=0.1, shake=0.8, noise=4.0), rng)
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """Drive there, work with the arm, and drive back."""
        self.hum = self.rng.normal(0, 0.5)
        goal = self._place(step)
        self.base = DOCK + (goal[0] - 6 - DOCK) * smooth(
            float(np.clip(4 * min(share, 1 - share), 0, 1))
        )
        ready = np.array([self.base, 70.0])
        reach = goal + [3 * np.sin(30 * share), 0] if step in ("wipe", "belt") else goal
        part = float(np.clip(2 * share - 0.5, 0, 1))
        self.arm, _ = along([ready, reach, reach, ready], part)
        brings = step in ("filter", "lamp", "sign")
        self.carried = step if brings and (part < 0.4 or not works) and share < 1 else None
        if works:
            self._effect(step, float(np.clip(2.5 * part - 0.75, 0, 1)))

    def rest(self) -> None:
        """Stand at the dock."""
        self.hum = self.rng.normal(0, 0.5)
        self.base, self.arm, self.carried = DOCK, np.array([DOCK, 70.0]), None

    def _place(self, step: str) -> Point:
        return np.array([PLACES[step], HEIGHTS[step]]) + self.shift[step]

    def _effect(self, step: str, part: float) -> None:
        if step == "oil":
            self.level = max(self.level, 0.15 + 0.75 * part)
        elif step == "wipe":
            self.stain = min(self.stain, 1 - part)
        elif step == "belt":
            self.sag = min(self.sag, 1 - part)
        elif part > 0:
            name = {"filter": "fresh", "lamp": "lit", "sign": "hung", "reset": "green"}[step]
            setattr(self, name, True)

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        image = np.full((120, 160, 3), BEHIND, np.uint8)
        image[GROUND:] = (92, 88, 84)
        canvas = Canvas(image)
        for number, x in enumerate((36.0, 78.0, 120.0)):
            canvas.box(np.array([x, 66.0]), (19, 34), colour_of(self.paint[number]))
        self._machines(canvas)
        self._machines_right(canvas)
        canvas.box(np.array([80.0, RAIL + 5]), (80, 2), (60, 60, 64))
        self._robot(canvas)
        return {"side": self.film.take(canvas.image)}

    def _machines(self, canvas: Canvas) -> None:
        place = self._place("filter")
        canvas.box(place, (7, 8), (70, 66, 60))
        canvas.box(place, (5, 6), (240, 238, 230) if self.fresh else (120, 104, 80))
        place = self._place("oil")
        canvas.box(place, (4, 12), (226, 226, 220))
        canvas.box(place + [0, 11 - 11 * self.level], (3, 11 * self.level), (200, 150, 40))
        place = self._place("wipe")
        canvas.box(place, (13, 9), (206, 214, 220))
        for spot in self.dirt:
            canvas.disc(place + spot * [5, 3.4], 2.2 * self.stain, (90, 76, 60))
        place = self._place("reset")
        canvas.disc(place, 3.5, (60, 190, 80) if self.green else (150, 40, 40))

    def _machines_right(self, canvas: Canvas) -> None:
        place = self._place("belt")
        low = place + [7, 14 * self.sag]
        for x in (-6, 20):
            canvas.disc(place + [x, 0], 5, (60, 60, 66))
        canvas.line(place + [-6, -5], place + [20, -5], 2, (30, 30, 30))
        canvas.line(place + [-6, 5], low + [0, 5], 2, (30, 30, 30))
        canvas.line(low + [0, 5], place + [20, 5], 2, (30, 30, 30))
        place = self._place("lamp")
        canvas.line(place - [0, 12], place, 2, (50, 50, 52))
        canvas.disc(place, 5, (255, 240, 170) if self.lit else (86, 84, 80))
        if self.hung:
            self._sign(canvas, self._place("sign"))

    def _robot(self, canvas: Canvas) -> None:
        base = np.array([self.base, RAIL])
        canvas.box(base, (11, 5), (230, 160, 40))
        canvas.box(base - [0, 12], (5, 9), (70, 74, 82))
        shoulder = base - [0, 20]
        elbow = (shoulder + self.arm) / 2 + [-8, -6 + self.hum]
        canvas.line(shoulder, elbow, 6, (230, 160, 40))
        canvas.line(elbow, self.arm, 5, (230, 160, 40))
        canvas.box(self.arm, (3, 3), (40, 42, 48))
        if self.carried == "filter":
            canvas.box(self.arm + [4, 0], (5, 6), (240, 238, 230))
        elif self.carried == "lamp":
            canvas.disc(self.arm + [3, -2], 4, (200, 200, 190))
        elif self.carried == "sign":
            self._sign(canvas, self.arm + [3, 3])

    def _sign(self, canvas: Canvas, place: Point) -> None:
        canvas.box(place, (7, 8), (236, 220, 60))
        canvas.line(place - [0, 5], place + [0, 2], 2, (30, 30, 30))
        canvas.disc(place + [0, 5], 1.2, (30, 30, 30))


SCENE = Scene(
    name="service",
    world=Service,
    steps=("filter", "oil", "wipe", "belt", "lamp", "sign"),
    spares=("reset",),
    waits={"oil": ("filter",), "sign": ("lamp",)},
    cameras=("side",),
    seconds=3.0,
)
