"""A gripper carries coloured squares from random places to places in a row."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, along, table
from scenes.scene import Scene

COLOURS = {
    "red": (210, 40, 40),
    "green": (40, 180, 60),
    "blue": (50, 80, 220),
    "yellow": (225, 200, 40),
    "magenta": (200, 60, 200),
    "white": (240, 240, 240),
}
HOME = np.array([80.0, 60.0])
BACKGROUND = table(120, 160, (128, 118, 105), 1)


class Squares:
    """Squares on a table and a gripper on a beam."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Lay the squares out."""
        places = rng.permutation(len(COLOURS))
        self.places = {
            name: np.array([20.0 + 24 * place, 98.0]) + rng.uniform(-5, 5, 2)
            for name, place in zip(COLOURS, places, strict=True)
        }
        self.start = dict(self.places)
        self.goals = {name: np.array([20.0 + 24 * k, 18.0]) for k, name in enumerate(COLOURS)}
        self.goals["white"] = np.array([148.0, 60.0])
        self.hand = HOME
        self.film = Film(Look(), rng)
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """Fetch a square, carry it, come back."""
        stops = [HOME, self.start[step], self.goals[step], HOME]
        self.hand, leg = along(stops, share)
        if works and leg > 0:
            self.places[step] = self.hand if leg == 1 else self.goals[step]

    def rest(self) -> None:
        """Tremble."""
        self.hand = HOME + self.rng.normal(0, 0.3, 2)

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        for name, place in self.places.items():
            canvas.box(place, (6, 6), COLOURS[name])
        canvas.line(np.array([self.hand[0], 0.0]), self.hand, 4, (90, 90, 95))
        canvas.disc(self.hand, 6, (50, 50, 55))
        return {"front": self.film.take(canvas.image)}


SCENE = Scene(
    name="squares",
    world=Squares,
    steps=("red", "green", "blue", "yellow", "magenta"),
    spares=("white",),
)
