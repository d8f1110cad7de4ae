"""A tool assembles small parts on a tray, filmed by a shaking camera, among loose things."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, along, table
from scenes.scene import Scene

BACKGROUND = table(120, 160, (120, 130, 120), 5)
TRAY = np.array([80.0, 62.0])
SEATS = {
    "plate": TRAY,
    "gear": TRAY + [-14, -6],
    "spring": TRAY + [14, -6],
    "screw_left": TRAY + [-22, 12],
    "screw_right": TRAY + [22, 12],
    "badge": TRAY + [0, 12],
    "wax": TRAY + [0, -12],
}
STORES = {
    "plate": np.array([26.0, 26.0]),
    "gear": np.array([62.0, 16.0]),
    "spring": np.array([86.0, 16.0]),
    "screw_left": np.array([110.0, 16.0]),
    "screw_right": np.array([122.0, 16.0]),
    "badge": np.array([142.0, 26.0]),
    "wax": np.array([146.0, 60.0]),
}
HOME = np.array([80.0, 112.0])


class Bench:
    """A tray, parts, a two-link arm, and things that do not matter."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Lay everything out."""
        self.places = {name: place + rng.normal(0, 2, 2) for name, place in STORES.items()}
        self.start = dict(self.places)
        self.hand = HOME
        self.clutter = [
            (
                np.array([rng.uniform(8, 40), rng.uniform(60, 110)]),
                rng.uniform(3, 7, 2),
                rng.integers(30, 230, 3),
            )
            for _ in range(3)
        ]
        self.fly = rng.uniform(0, 100, 2)
        self.film = Film(Look(shake=0.8, light=0.1), rng)
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """Fetch a part, put it in its seat, press it down."""
        self._buzz()
        seat = SEATS[step]
        stops = [HOME, self.start[step], seat, seat + [0, 3], HOME]
        self.hand, leg = along(stops, share)
        if works and leg >= 1:
            self.places[step] = self.hand if leg == 1 else seat

    def rest(self) -> None:
        """Wait."""
        self._buzz()
        self.hand = HOME

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        for place, half, colour in self.clutter:
            canvas.box(place, half, tuple(int(value) for value in colour), 0.4)
        canvas.box(TRAY, (36, 24), (60, 62, 70))
        for name in SEATS:
            self._part(canvas, name, self.places[name])
        shoulder = np.array([150.0, 130.0])
        elbow = (self.hand + shoulder) / 2 + [10, -14]
        canvas.line(shoulder, elbow, 9, (220, 130, 40))
        canvas.line(elbow, self.hand, 6, (220, 130, 40))
        canvas.disc(self.hand, 4, (40, 40, 40))
        canvas.disc(self.fly, 2, (20, 20, 20))
        return {"front": self.film.take(canvas.image)}

    def _buzz(self) -> None:
        self.fly = (self.fly + self.rng.normal(0, 4, 2)) % [160, 120]

    def _part(self, canvas: Canvas, name: str, place: np.ndarray) -> None:
        if name == "plate":
            canvas.box(place, (30, 19), (180, 185, 190))
        elif name == "gear":
            canvas.disc(place, 8, (200, 160, 60))
            canvas.disc(place, 3, (90, 70, 30))
        elif name == "spring":
            for k in range(4):
                canvas.line(place + [-5, 4 * k - 6], place + [5, 4 * k - 4], 2, (70, 110, 200))
        elif name.startswith("screw"):
            canvas.disc(place, 3.5, (40, 42, 46))
        elif name == "badge":
            canvas.box(place, (8, 4), (210, 50, 60))
        else:
            canvas.disc(place, 5, (240, 240, 200))


SCENE = Scene(
    name="bench",
    world=Bench,
    steps=("plate", "gear", "spring", "screw_left", "screw_right", "badge"),
    spares=("wax",),
    waits=dict.fromkeys(("gear", "spring", "screw_left", "screw_right", "badge"), ("plate",)),
    optional=("badge",),
)
