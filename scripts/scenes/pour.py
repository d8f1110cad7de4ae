"""Bottles are poured into a glass whose colour and level change; ice, a spoon, a straw."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, along, table
from scenes.scene import Scene

BACKGROUND = table(120, 160, (175, 165, 150), 4)
GLASS = np.array([80.0, 88.0])
SYRUPS = {
    "red": (190, 30, 50),
    "yellow": (235, 190, 40),
    "blue": (50, 80, 190),
    "milk": (245, 245, 240),
}
SHELF = {
    "red": np.array([16.0, 88.0]),
    "yellow": np.array([38.0, 88.0]),
    "blue": np.array([122.0, 88.0]),
    "milk": np.array([144.0, 88.0]),
    "ice": np.array([120.0, 40.0]),
    "straw": np.array([34.0, 40.0]),
}
HOME = np.array([80.0, -6.0])
LEVEL = 9.0


class Pour:
    """A shelf, a glass, and a gripper from above."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Fill the bottles; they stand a little elsewhere in every video."""
        self.shelf = {name: place + rng.normal(0, 2, 2) * [1, 0.3] for name, place in SHELF.items()}
        self.amounts: dict[str, float] = {}
        self.things: set[str] = set()
        self.hand = HOME
        self.held: tuple[str, np.ndarray, float] | None = None
        self.stream: str | None = None
        self.fill = {name: rng.uniform(8, 14) for name in SYRUPS}
        self.film = Film(Look(offset=2.5, shake=0.3), rng)
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """Pour a bottle, or put something in the glass."""
        self.held = self.stream = None
        start = self.shelf[step] + [0, -12]
        over = GLASS + [0, -46]
        if step in SYRUPS:
            side = np.sign(self.shelf[step][0] - GLASS[0]) * np.array([14.0, 0])
            stops = [HOME, start, over + side, over + side, start, HOME]
            self.hand, leg = along(stops, share)
            tilt = np.sin(np.pi * (share * 5 - 2)) if leg == 2 else 0.0
            if 1 <= leg <= 3:
                self.held = (step, self.hand, float(-tilt * 2 * np.sign(side[0])))
            if works and leg == 2 and tilt > 0.4:
                self.stream = step
                self.amounts[step] = min(LEVEL, self.amounts.get(step, 0.0) + 1.8)
            if works and leg > 2:
                self.amounts[step] = LEVEL
            return
        self.hand, leg = along([HOME, start + [0, 8], over, over + [0, 22], HOME], share)
        if works and leg in (1, 2):
            self.held = (step, self.hand + [0, 8], 0.0)
        if works and leg == 3:
            self.things.add(step)

    def rest(self) -> None:
        """Hold the gripper up."""
        self.hand = HOME + self.rng.normal(0, 0.3, 2)
        self.held = self.stream = None

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        canvas.box(np.array([80.0, 112.0]), (90, 9), (110, 80, 55))
        for name, place in self.shelf.items():
            if not (self.held and self.held[0] == name) and name not in self.things:
                self._thing(canvas, name, place, 0.0)
        self._glass(canvas)
        if self.held:
            self._thing(canvas, *self.held)
        canvas.line(np.array([self.hand[0], -20.0]), self.hand, 4, (70, 70, 76))
        canvas.box(self.hand, (8, 3), (40, 40, 45))
        return {"front": self.film.take(canvas.image)}

    def _glass(self, canvas: Canvas) -> None:
        if "straw" in self.things:
            canvas.line(GLASS + [4, 8], GLASS + [10, -32], 2, (230, 60, 120))
        canvas.box(GLASS, (12, 17), (205, 212, 215))
        total = sum(self.amounts.values())
        if total:
            mixed = (
                sum(np.array(SYRUPS[name]) * part for name, part in self.amounts.items()) / total
            )
            colour = tuple(int(value) for value in mixed)
            canvas.box(GLASS + [0, 16 - total / 2], (11, total / 2), colour)
        if "ice" in self.things:
            top = 16 - min(total, 26)
            canvas.box(GLASS + [-5, max(top, -10)], (4, 4), (225, 240, 250), 0.4)
            canvas.box(GLASS + [5, max(top, -10) + 1], (4, 4), (215, 232, 245), -0.3)
        if self.stream:
            canvas.line(GLASS + [0, -44], GLASS + [0, 10], 2, SYRUPS[self.stream])

    def _thing(self, canvas: Canvas, name: str, place: np.ndarray, tilt: float) -> None:
        if name in SYRUPS:
            canvas.box(place, (7, 15), (225, 228, 228), tilt)
            canvas.box(place, (6, self.fill[name]), SYRUPS[name], tilt)
        elif name == "ice":
            canvas.box(place, (5, 4), (220, 238, 250), 0.3)
        else:
            canvas.line(place + [-2, -10], place + [2, 10], 2, (230, 60, 120))


SCENE = Scene(
    name="pour",
    world=Pour,
    steps=("red", "yellow", "ice", "blue", "straw"),
    spares=("milk",),
    waits={"straw": ("red", "yellow")},
    seconds=3.0,
)
