"""A gloved hand plants a seedling in a pot, from the side, outdoors in moving light."""

import numpy as np

from scenes.parts.drawing import Canvas, Colour, Film, Look, Point, along, table
from scenes.parts.people import Clutter, Daylight, colour_of, draw_arm
from scenes.scene import Scene

BACKGROUND = table(120, 160, (150, 176, 150), 31)
POT = np.array([80.0, 96.0])
TOP = POT - [0, 22]
STORES = {
    "pebbles": np.array([16.0, 96.0]),
    "soil": np.array([40.0, 92.0]),
    "plant": np.array([120.0, 90.0]),
    "water": np.array([146.0, 92.0]),
    "stick": np.array([26.0, 74.0]),
    "feed": np.array([140.0, 70.0]),
}
HOME = np.array([156.0, 30.0])
SHELF = np.array([80.0, 34.0])
SOIL, WET = np.array([110, 74, 46]), np.array([62, 40, 28])


class Garden:
    """A pot, what goes into it, and a watering can."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Put things where they are in this video."""
        self.stores = {name: place + rng.normal(0, 2, 2) for name, place in STORES.items()}
        self.side = int(rng.integers(2))
        self.home = HOME if self.side else np.array([4.0, 30.0])
        self.pebbles = self.soil = self.wet = self.pressed = self.fed = 0.0
        self.cloth = 0.0
        self.planted = self.marked = False
        self.carried: str | None = None
        self.hand: Point = self.home
        self.leaves = rng.normal(0, 1, (7, 2))
        self.clay = colour_of(np.array([178, 92, 60]) + rng.normal(0, 14, 3))
        self.glove = ((90, 130, 70), (190, 150, 60), (110, 110, 130))[rng.integers(3)]
        self.wind = 0.0
        self.clutter = Clutter(np.array([[60.0, 12.0], [112, 12], [20, 16]]), 6, rng)
        self.light = Daylight(0.25, rng)
        self.film = Film(Look(light=0.15, drift=0.15, shake=0.2), rng)
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        self.rest()
        if step == "press":
            self._press(share, works)
        elif step == "shade":
            self._stroke(share, works)
        else:
            self._bring(step, share, works)

    def rest(self) -> None:
        """Take the hand away; leaves move in the wind."""
        self.hand, self.carried = self.home + self.rng.normal(0, 1.0, 2), None
        self.wind = 0.9 * self.wind + self.rng.normal(0, 0.5)

    def _bring(self, thing: str, share: float, works: bool) -> None:
        """Fetch something, use it above the pot, and lay back what is left."""
        store, above = self.stores[thing], TOP - [0, 14]
        if thing == "plant":
            stops = [self.home, store, store - [0, 30], above, TOP, self.home]
        elif thing == "stick":
            stops = [self.home, store, store - [0, 30], above + [12, 0], TOP + [12, 0], self.home]
        else:
            stops = [self.home, store, store - [0, 30], above, above, store, self.home]
        self.hand, leg = along(stops, share)
        legs, last = len(stops) - 1, 3 if thing in ("plant", "stick") else 4
        holds = 1 <= leg <= last and not (thing == "plant" and self.planted)
        self.carried = thing if holds and (works or thing not in ("plant", "stick")) else None
        if works:
            self._effect(thing, float(np.clip(legs * share - 3, 0, 1)))

    def _effect(self, thing: str, part: float) -> None:
        if thing == "pebbles":
            self.pebbles = max(self.pebbles, part)
        elif thing == "soil":
            self.soil = max(self.soil, part)
        elif thing == "water":
            self.wet = max(self.wet, part)
        elif thing == "feed":
            self.fed = max(self.fed, part)
        elif thing == "plant":
            self.planted = self.planted or part == 1
        else:
            self.marked = self.marked or part == 1

    def _press(self, share: float, works: bool) -> None:
        low = TOP + [0, -2]
        self.hand, leg = along(
            [self.home, low - [10, 8], low - [8, 0], low + [8, 0], low + [10, -8], self.home], share
        )
        if works and leg >= 2:
            self.pressed = max(self.pressed, min(1.0, 5 * share - 2))

    def _stroke(self, share: float, works: bool) -> None:
        """Hang a cloth over the shelf above."""
        stops = [self.home, SHELF - [30, 0], SHELF + [30, 0], self.home]
        self.hand, leg = along(stops, share)
        if works and leg >= 1:
            self.cloth = max(self.cloth, min(1.0, 3 * share - 1))

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        self.clutter.draw(canvas)
        canvas.line(np.array([30.0, 26.0]), np.array([130.0, 26.0]), 2, (120, 120, 124))
        if self.cloth > 0:
            canvas.box(SHELF + [-30 + 30 * self.cloth, 2], (30 * self.cloth, 9), (206, 206, 220))
        canvas.box(np.array([80.0, 116.0]), (90, 8), (132, 100, 70))
        self._pot(canvas)
        for thing in self.stores:
            gone = (thing == "plant" and self.planted) or (thing == "stick" and self.marked)
            if thing != self.carried and not gone:
                self._thing(canvas, thing, self.stores[thing])
        if self.carried:
            self._thing(canvas, self.carried, self.hand + [0, 8], pours=self._above())
        elbow = self.hand + (self.home - self.hand) * 0.5 + [30 if self.side else -30, -40]
        draw_arm(
            canvas, self.hand, elbow, ((60, 80, 110), self.glove), grip=float(bool(self.carried))
        )
        return {"side": self.film.take(self.light.fall(canvas.image))}

    def _above(self) -> bool:
        return bool(abs(self.hand[0] - TOP[0]) < 4 and self.hand[1] > TOP[1] - 24)

    def _pot(self, canvas: Canvas) -> None:
        earth = SOIL + (WET - SOIL) * self.wet
        if self.planted:
            self._seedling(canvas, TOP)
        if self.marked:
            canvas.line(TOP + [13, 4], TOP + [13, -14], 3, (236, 232, 220))
        heap = self.soil * (8 - 5 * self.pressed)
        if self.soil > 0:
            canvas.polygon(
                TOP + np.array([[-15, 2], [-8, -heap], [8, -heap], [15, 2]]), colour_of(earth)
            )
        canvas.polygon(TOP + np.array([[-17, 0], [17, 0], [12, 30], [-12, 30]]), self.clay)
        self._layers(canvas, colour_of(earth))
        canvas.box(TOP + [0, 1], (19, 3), colour_of(0.85 * np.array(self.clay)))
        for k in range(round(6 * self.fed)):
            canvas.disc(TOP + [-10 + 4 * k, -2], 1.6, (90, 170, 220))

    def _layers(self, canvas: Canvas, earth: Colour) -> None:
        """Draw what is in the pot; it has a window."""
        if self.pebbles > 0:
            for k in range(round(7 * self.pebbles)):
                canvas.disc(TOP + [-6 + 2 * k, 24 - 3 * (k % 2)], 2.4, (196, 196, 200))
        if self.soil > 0:
            canvas.box(TOP + [0, 18 - 7 * self.soil], (7, 7 * self.soil), earth)

    def _seedling(self, canvas: Canvas, root: Point) -> None:
        tip = root + [self.wind, -24]
        canvas.line(root, tip, 2, (70, 120, 50))
        for k, leaf in enumerate(self.leaves):
            place = root + (tip - root) * (0.3 + 0.11 * k) + leaf + [6 * (-1) ** k, 0]
            canvas.disc(place, 4, (60 + 8 * k, 150, 60))

    def _thing(self, canvas: Canvas, thing: str, place: Point, pours: bool = False) -> None:
        if thing == "plant":
            self._seedling(canvas, place)
            canvas.box(place + [0, 5], (6, 6), (60, 44, 34))
        elif thing == "stick":
            canvas.line(place, place - [0, 16], 3, (236, 232, 220))
        else:
            colours = {"pebbles": (190, 190, 196), "soil": (96, 66, 44), "feed": (80, 150, 210)}
            canvas.box(place, (9, 8), colours.get(thing, (60, 110, 90)))
            if thing == "water":
                canvas.line(place + [-8, 4], place + [-16, -6], 3, (60, 110, 90))
            if pours:
                stream = (120, 170, 220) if thing == "water" else colours[thing]
                canvas.line(place + [0, 6], TOP + [0, 2], 3, stream)


SCENE = Scene(
    name="garden",
    world=Garden,
    steps=("pebbles", "soil", "plant", "press", "water", "stick", "shade"),
    spares=("feed",),
    waits={
        "soil": ("pebbles",),
        "plant": ("soil",),
        "press": ("plant",),
        "water": ("press",),
        "stick": ("soil",),
    },
    optional=("stick",),
    cameras=("side",),
    seconds=3.0,
)
