"""Two hands of a person make a sandwich on a plate, filmed from above by a camera that sways."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, along, table
from scenes.scene import Scene

SKIN = (205, 155, 125)
PLATE = np.array([80.0, 55.0])
BACKGROUND = table(120, 160, (150, 160, 165), 2)
AWAY = (np.array([35.0, 135.0]), np.array([125.0, 135.0]))
STORES = {
    "bread": np.array([24.0, 28.0]),
    "butter": np.array([136.0, 28.0]),
    "cheese": np.array([24.0, 62.0]),
    "tomato": np.array([136.0, 62.0]),
    "lid": np.array([24.0, 92.0]),
    "salt": np.array([136.0, 92.0]),
}
RIGHT = {"butter", "tomato", "salt"}


class Hands:
    """A plate, what lies around it, and two hands with sleeves."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Lay things out; the hands differ from person to person."""
        self.stores = {name: place + rng.normal(0, 2, 2) for name, place in STORES.items()}
        self.done: dict[str, float] = {}
        self.cut = 0.0
        self.carried: tuple[str, np.ndarray] | None = None
        self.skin = tuple(int(v) for v in np.clip(np.array(SKIN) * rng.uniform(0.6, 1.1), 0, 255))
        self.sleeve = tuple(int(v) for v in rng.integers(40, 200, 3))
        self.hands = [hand.copy() for hand in AWAY]
        self.jitter = rng.normal(0, 2, 2)
        self.cup = np.array([rng.uniform(50, 110), rng.uniform(4, 12)])
        self.film = Film(Look(shake=0.6), rng)
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """Fetch something and put it on the plate, or work on the plate."""
        hand = int(step in RIGHT or step == "cut")
        place = PLATE + self.jitter
        self.carried = None
        if step == "cut":
            sway = np.array([0.0, 12 * np.cos(share * 6 * np.pi)])
            self.hands[1], leg = along([AWAY[1], place, place, place, AWAY[1]], share)
            self.hands[1] = self.hands[1] + sway * (0 < leg < 3)
            self.hands[0], _ = along([AWAY[0], place + [-20, 6], place + [-20, 6], AWAY[0]], share)
            self.cut = max(self.cut, works * min(1.0, 1.5 * share))
            return
        if step in ("butter", "salt"):
            stops = [AWAY[hand], self.stores[step], place + [-8, 0], place + [8, 4], AWAY[hand]]
        else:
            stops = [AWAY[hand], self.stores[step], place, AWAY[hand]]
        self.hands[hand], leg = along(stops, share)
        last = len(stops) - 2
        if works and leg == 1 and step not in ("butter", "salt"):
            self.carried = (step, self.hands[hand] + [0, -6])
        if works and leg == last:
            self.done[step] = 1.0

    def rest(self) -> None:
        """Take the hands away, more or less."""
        self.hands = [hand + self.rng.normal(0, 1.0, 2) for hand in AWAY]
        self.carried = None

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        canvas.disc(self.cup, 7, (90, 110, 150))
        canvas.disc(PLATE, 30, (235, 235, 230))
        canvas.disc(PLATE, 24, (220, 220, 216))
        for name, place in self.stores.items():
            taken = name in self.done or (self.carried and self.carried[0] == name)
            if name in ("butter", "salt"):
                canvas.disc(place, 7, (240, 215, 90) if name == "butter" else (250, 250, 250))
            elif not taken:
                self._thing(canvas, name, place)
        for name in self.done:
            self._thing(canvas, name, PLATE + self.jitter)
        if self.cut:
            end = PLATE + self.jitter + [0, 18 * (2 * self.cut - 1)]
            canvas.line(PLATE + self.jitter - [0, 18], end, 2, (80, 50, 30))
        if self.carried:
            self._thing(canvas, *self.carried)
        for hand, away in zip(self.hands, AWAY, strict=True):
            self._hand(canvas, hand, away)
        return {"front": self.film.take(canvas.image)}

    def _thing(self, canvas: Canvas, name: str, place: np.ndarray) -> None:
        if name == "bread":
            canvas.box(place, (15, 13), (190, 140, 80))
            canvas.box(place, (13, 11), (235, 210, 160))
        elif name == "butter":
            canvas.box(place, (10, 8), (245, 225, 110))
        elif name == "cheese":
            canvas.box(place, (10, 10), (250, 180, 30), 0.3)
        elif name == "tomato":
            canvas.disc(place + [-5, 0], 6, (205, 45, 35))
            canvas.disc(place + [5, 2], 6, (205, 45, 35))
        elif name == "lid":
            canvas.box(place, (14, 12), (150, 95, 45))
        elif name == "salt":
            for k in range(6):
                canvas.disc(place + [5 * (k % 3) - 5, 6 * (k // 3) - 3], 1.2, (255, 255, 255))

    def _hand(self, canvas: Canvas, hand: np.ndarray, away: np.ndarray) -> None:
        elbow = away + [0, 20]
        canvas.line(hand, elbow, 15, self.sleeve)
        canvas.line(hand, hand + 0.2 * (elbow - hand), 12, self.skin)
        canvas.disc(hand, 8, self.skin)
        for finger in (-5, 0, 5):
            canvas.line(hand, hand + [finger, -11], 3, self.skin)


SCENE = Scene(
    name="hands",
    world=Hands,
    steps=("bread", "butter", "cheese", "tomato", "lid", "cut"),
    spares=("salt",),
    waits={
        "butter": ("bread",),
        "cheese": ("butter",),
        "tomato": ("butter",),
        "lid": ("cheese", "tomato"),
        "cut": ("lid",),
    },
)
