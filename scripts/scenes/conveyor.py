"""A belt brings a box to machines that work on it; other boxes pass by behind."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, smooth
from scenes.scene import Scene

STATIONS = {"fill": 34.0, "cap": 62.0, "label": 90.0, "stamp": 118.0, "crate": 146.0, "spray": 76.0}
HEADS = {
    "fill": (60, 110, 200),
    "cap": (200, 170, 60),
    "label": (190, 190, 200),
    "stamp": (170, 60, 60),
    "crate": (90, 140, 90),
    "spray": (150, 90, 170),
}
BELT = 84.0


class Conveyor:
    """A belt with one box on it, a belt behind it, and machines above."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Put the box on the belt, and boxes on the other belt."""
        self.box = 10.0 + rng.uniform(-3, 3)
        self.origin = self.box
        self.head: tuple[str, float] | None = None
        self.done: dict[str, float] = {}
        self.travel = 0.0
        self.others = rng.uniform(0, 400, 5)
        self.colours = rng.integers(60, 220, (5, 3))
        self.film = Film(Look(drift=0.06), rng)
        self.wear = rng.normal(0, 3, (120, 160, 1))

    def move(self, step: str, share: float, works: bool) -> None:
        """Drive the box to a machine, which comes down on it."""
        self.others = self.others + 1.3
        if share < 0.4:
            self.head = None
            target = STATIONS[step]
            box = self.origin + (target - self.origin) * smooth(share / 0.4)
            self.travel += box - self.box
            self.box = box
            return
        self.origin = self.box = STATIONS[step]
        down = np.sin(np.pi * (share - 0.4) / 0.6)
        self.head = (step, float(down)) if share < 1 else None
        if works and share > 0.7:
            self.done[step] = min(1.0, (share - 0.7) / 0.2)

    def rest(self) -> None:
        """Wait; the belt behind goes on."""
        self.head = None
        self.others = self.others + 1.3

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(np.full((120, 160, 3), (170, 172, 168), np.uint8))
        self._behind(canvas)
        canvas.box(np.array([80.0, BELT + 18]), (90, 6), (60, 60, 62))
        for k in range(12):
            x = (k * 16 + self.travel) % 192 - 16
            canvas.box(np.array([x, BELT + 18]), (2, 6), (90, 90, 92))
        self._load(canvas)
        for name, x in STATIONS.items():
            down = self.head[1] if self.head and self.head[0] == name else 0.0
            y = 40.0 + 26 * down
            canvas.line(np.array([x, 30.0]), np.array([x, y]), 3, (80, 80, 85))
            canvas.box(np.array([x, y]), (6, 5), HEADS[name])
        return {"front": self.film.take(np.clip(canvas.image + self.wear, 0, 255))}

    def _behind(self, canvas: Canvas) -> None:
        canvas.box(np.array([80.0, 16.0]), (90, 3), (110, 110, 112))
        for x, colour in zip(self.others, self.colours, strict=True):
            place = np.array([x % 400 - 40, 8.0])
            canvas.box(place, (6, 6), tuple(int(value) for value in colour))

    def _load(self, canvas: Canvas) -> None:
        place = np.array([self.box, BELT])
        canvas.box(place, (11, 12), (225, 225, 220))
        if (filled := self.done.get("fill", 0)) > 0:
            canvas.box(place + [0, 11 - 8 * filled], (10, 8 * filled), (60, 130, 220))
        if "cap" in self.done:
            canvas.box(place + [0, -13], (8, 3), (210, 150, 40))
        if "label" in self.done:
            canvas.box(place + [0, 2], (7, 4), (250, 250, 120))
        if "stamp" in self.done:
            canvas.disc(place + [5, 5], 3.5, (200, 30, 30))
        if "spray" in self.done:
            canvas.box(place + [-6, -4], (3, 6), (150, 60, 180))
        if (crated := self.done.get("crate", 0)) > 0:
            canvas.box(place + [0, 12 - 5 * crated], (13, 5 * crated), (120, 85, 45))


SCENE = Scene(
    name="conveyor",
    world=Conveyor,
    steps=("fill", "cap", "label", "stamp", "crate"),
    spares=("spray",),
    waits={"cap": ("fill",), "stamp": ("cap",), "crate": ("fill",)},
    optional=("label",),
    seconds=2.8,
)
