"""A robot with two arms lays a table, filmed from above and by a second camera at an angle."""

import cv2
import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, Point, along, table
from scenes.parts.people import Clutter
from scenes.scene import Scene

BACKGROUND = table(120, 160, (176, 168, 160), 41)
SEAT = np.array([80.0, 74.0])
PLACES = {
    "mat": SEAT,
    "plate": SEAT,
    "fork": SEAT + [-24, 0],
    "knife": SEAT + [24, 0],
    "glass": SEAT + [30, -24],
    "napkin": SEAT + [-34, 2],
    "bread": SEAT + [-28, -24],
}
STORES = {
    "mat": np.array([80.0, 16.0]),
    "plate": np.array([22.0, 26.0]),
    "fork": np.array([10.0, 64.0]),
    "knife": np.array([150.0, 64.0]),
    "glass": np.array([136.0, 22.0]),
    "napkin": np.array([14.0, 94.0]),
    "bread": np.array([48.0, 14.0]),
}
JUG = np.array([150.0, 96.0])
CANDLE = np.array([112.0, 20.0])
HOMES = (np.array([44.0, 112.0]), np.array([116.0, 112.0]))
BASES = (np.array([30.0, 140.0]), np.array([130.0, 140.0]))
CORNERS = np.float32([[0, 0], [159, 0], [159, 119], [0, 119]])
ANGLED = np.float32([[34, 16], [150, 30], [172, 128], [-20, 104]])
"""Where the corners of the view from above lie for the second camera [pixels]."""


class Supper:
    """A seat at a table, what belongs to it, and two arms."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Put things where they are in this video."""
        self.where = {name: place + rng.normal(0, 2, 2) for name, place in STORES.items()}
        self.start = dict(self.where)
        self.jug = JUG + rng.normal(0, 1.5, 2)
        self.poured = self.flame = 0.0
        self.arms: list[Point] = list(HOMES)
        self.holds: tuple[int, str] | None = None
        self.flicker = 0.0
        self.shade = rng.normal(0, 8, 3)
        self.clutter = Clutter(np.array([[12.0, 112.0], [150, 114]]), 4, rng)
        self.films = {
            "above": Film(Look(), rng),
            "angled": Film(Look(offset=3, turn=0.02, light=0.12, noise=5.0), rng),
        }
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        self.rest()
        if step == "pour":
            self._pour(share, works)
        elif step == "candle":
            self._light(share, works)
        else:
            self._lay(step, share, works)

    def rest(self) -> None:
        """Wait with the arms drawn back."""
        self.arms, self.holds = list(HOMES), None
        self.flicker = self.rng.normal(0, 0.6)

    def _lay(self, thing: str, share: float, works: bool) -> None:
        arm = int(self.start[thing][0] > 80 or thing == "mat")
        start, goal = self.start[thing], PLACES[thing]
        stops = [HOMES[arm], start, goal, goal + [0, 5], HOMES[arm]]
        self.arms[arm], leg = along(stops, share)
        if works and leg >= 1:
            self.where[thing] = self.arms[arm] if leg == 1 else goal
            self.holds = (arm, thing) if leg == 1 else None

    def _pour(self, share: float, works: bool) -> None:
        over = self.where["glass"] + [0, 8]
        stops = [HOMES[1], self.jug, over, over, self.jug, HOMES[1]]
        self.arms[1], leg = along(stops, share)
        if 1 <= leg <= 3:
            self.holds = (1, "jug")
        if works:
            self.poured = max(self.poured, float(np.clip(5 * share - 2, 0, 1)))

    def _light(self, share: float, works: bool) -> None:
        stops = [HOMES[0], CANDLE + [-8, 8], CANDLE + [-3, 4], CANDLE + [-8, 8], HOMES[0]]
        self.arms[0], leg = along(stops, share)
        if works and leg >= 2:
            self.flame = 1.0

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas((BACKGROUND + self.shade).clip(0, 255).astype(np.uint8))
        self.clutter.draw(canvas)
        for name in ("mat", "napkin", "plate", "fork", "knife", "bread", "glass"):
            self._thing(canvas, name, self.where[name])
        canvas.box(CANDLE, (4, 4), (230, 222, 200))
        if self.flame:
            canvas.disc(CANDLE, 3.4 + 0.3 * self.flicker, (255, 190, 60))
        jug = self.arms[1] - [0, 6] if self.holds == (1, "jug") else self.jug
        canvas.disc(jug, 9, (200, 206, 214))
        canvas.disc(jug, 6, (150, 60, 70))
        for arm, base in zip(self.arms, BASES, strict=True):
            elbow = (arm + base) / 2 + [12 if base[0] > 80 else -12, 0]
            canvas.line(base, elbow, 10, (226, 226, 230))
            canvas.line(elbow, arm, 8, (206, 206, 212))
            canvas.box(arm, (6, 4), (50, 52, 58))
        view = cv2.getPerspectiveTransform(CORNERS, ANGLED)
        angled = cv2.warpPerspective(
            canvas.image, view, (160, 120), borderMode=cv2.BORDER_CONSTANT, borderValue=(90, 84, 80)
        )
        return {
            "above": self.films["above"].take(canvas.image),
            "angled": self.films["angled"].take(angled),
        }

    def _thing(self, canvas: Canvas, name: str, place: Point) -> None:
        if name == "mat":
            canvas.box(place, (36, 20), (70, 110, 130))
        elif name == "plate":
            canvas.disc(place, 17, (244, 244, 240))
            canvas.disc(place, 11, (226, 226, 224))
        elif name == "napkin":
            canvas.box(place, (6, 12), (180, 60, 70))
        elif name == "bread":
            canvas.disc(place, 7, (196, 140, 80))
        elif name == "glass":
            canvas.disc(place, 6, (214, 226, 232))
            if self.poured > 0:
                canvas.disc(place, 5 * self.poured, (140, 40, 56))
        else:
            canvas.line(place - [0, 12], place + [0, 12], 2, (120, 124, 132))
            if name == "fork":
                canvas.line(place + [-2, -12], place + [2, -12], 4, (120, 124, 132))
            else:
                canvas.line(place - [0, 12], place, 4, (120, 124, 132))


SCENE = Scene(
    name="supper",
    world=Supper,
    steps=("mat", "plate", "fork", "knife", "napkin", "glass", "pour", "candle"),
    spares=("bread",),
    waits={
        "plate": ("mat",),
        "fork": ("mat",),
        "knife": ("mat",),
        "glass": ("mat",),
        "pour": ("glass",),
        "candle": ("pour",),
    },
    optional=("napkin",),
    cameras=("above", "angled"),
)
