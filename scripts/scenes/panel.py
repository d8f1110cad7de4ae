"""A finger works a panel: buttons that light lamps, a slider, a dial, a flap."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, along, smooth, table
from scenes.scene import Scene

AWAY = np.array([80.0, 150.0])
BACKGROUND = table(120, 160, (95, 100, 110), 3)
PARTS = {
    "power": np.array([24.0, 84.0]),
    "pump": np.array([52.0, 84.0]),
    "alarm": np.array([80.0, 84.0]),
    "slider": np.array([104.0, 60.0]),
    "dial": np.array([136.0, 84.0]),
    "flap": np.array([136.0, 36.0]),
}
LAMPS = {"power": (90, 240, 90), "pump": (250, 200, 60), "alarm": (250, 70, 60)}


class Panel:
    """The panel and an arm with a finger."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Everything is off; the panel hangs somewhere else in every video."""
        self.state = dict.fromkeys(PARTS, 0.0)
        self.shift = rng.normal(0, 3, 2)
        self.finger = AWAY
        self.sleeve = tuple(int(value) for value in rng.integers(40, 210, 3))
        self.note = np.array([rng.uniform(10, 70), rng.uniform(10, 22)])
        self.film = Film(Look(light=0.12, drift=0.05), rng)

    def move(self, step: str, share: float, works: bool) -> None:
        """Reach for a part, work it, go away."""
        place = PARTS[step] + self.shift
        if step == "slider":
            stops = [AWAY, place + [0, 20], place + [0, -18], AWAY]
        elif step == "flap":
            stops = [AWAY, place + [0, 10], place + [0, -12], AWAY]
        elif step == "dial":
            stops = [AWAY, place + [10, 0], place + [-10, 0], AWAY]
        else:
            stops = [AWAY, place, place, AWAY]
        self.finger, leg = along(stops, share)
        inside = smooth(share * 3 - 1) if leg == 1 else float(leg == 2)
        if works and leg >= 1:
            self.state[step] = inside if step not in LAMPS else float(inside > 0.5)

    def rest(self) -> None:
        """Keep the finger away."""
        self.finger = AWAY

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        canvas.box(np.array([80.0, 60.0]) + self.shift, (74, 48), (70, 74, 82))
        canvas.box(self.note + self.shift, (8, 5), (235, 230, 150))
        for name, colour in LAMPS.items():
            place = PARTS[name] + self.shift
            canvas.disc(place, 6, (40, 40, 44))
            canvas.disc(place, 4, (160, 160, 165))
            canvas.disc(place - [0, 34], 5, colour if self.state[name] else (60, 55, 55))
        place = PARTS["slider"] + self.shift
        canvas.box(place, (2, 22), (30, 30, 32))
        canvas.box(place + [0, 20 - 38 * self.state["slider"]], (7, 3), (200, 200, 205))
        place = PARTS["dial"] + self.shift
        angle = -2.2 + 3.0 * self.state["dial"]
        canvas.disc(place, 12, (35, 35, 40))
        canvas.line(
            place, place + 11 * np.array([np.sin(angle), -np.cos(angle)]), 3, (240, 240, 240)
        )
        place = PARTS["flap"] + self.shift
        canvas.box(place, (14, 11), (190, 120, 50))
        height = 11 * (1 - 0.85 * self.state["flap"])
        canvas.box(place + [0, -11 + height], (14, height), (120, 125, 135))
        canvas.line(
            self.finger, self.finger + 0.9 * (AWAY - self.finger) + [0, 30], 12, self.sleeve
        )
        canvas.line(self.finger, self.finger + [0, 14], 5, (200, 150, 120))
        return {"front": self.film.take(canvas.image)}


SCENE = Scene(
    name="panel",
    world=Panel,
    steps=("power", "slider", "pump", "dial", "flap"),
    spares=("alarm",),
    waits={"slider": ("power",), "pump": ("power",)},
)
