"""A person packs a parcel at a desk, seen from above by a hand-held camera."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, Point, along, smooth
from scenes.parts.people import Clutter, Daylight, colour_of, draw_arm, wood
from scenes.scene import Scene

BACKGROUND = wood(120, 160, (150, 112, 80), 21)
BOX = np.array([84.0, 62.0])
HALF = np.array([27.0, 20.0])
STORES = {
    "book": np.array([24.0, 40.0]),
    "card": np.array([26.0, 76.0]),
    "mug": np.array([50.0, 18.0]),
    "paper": np.array([140.0, 92.0]),
    "tape": np.array([140.0, 36.0]),
    "stamp": np.array([142.0, 62.0]),
}
INSIDE = {
    "book": np.array([-9.0, 1.0]),
    "card": np.array([13.0, -7.0]),
    "mug": np.array([14.0, 9.0]),
}
TRAY = np.array([84.0, 2.0])
AWAY = (np.array([34.0, 128.0]), np.array([132.0, 128.0]))


class Parcel:
    """A box with flaps, what goes into it, and what closes it."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Put things where they are in this video."""
        self.stores = {name: place + rng.normal(0, 2.5, 2) for name, place in STORES.items()}
        self.start = self.box = BOX + rng.normal(0, 2, 2)
        self.flaps, self.filled, self.taped, self.stamped = 0.0, 0.0, 0.0, False
        self.inside: set[str] = set()
        self.on_top: set[str] = set()
        self.carried: str | None = None
        self.hands: list[Point] = list(AWAY)
        self.grip = 0.0
        self.cover = colour_of(rng.integers(40, 200, 3))
        self.rustle = rng.normal(0, 1, (14, 2))
        sleeves = ((40, 60, 110), (120, 50, 60), (70, 70, 74))[rng.integers(3)]
        skin = ((224, 180, 150), (160, 112, 82), (102, 70, 52))[rng.integers(3)]
        self.colours = (sleeves, skin)
        self.clutter = Clutter(np.array([[12.0, 12.0], [150, 112], [112, 12]]), 4, rng)
        self.light = Daylight(0.15, rng)
        self.film = Film(Look(light=0.12, drift=0.08, shake=0.5), rng)
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        self.rest()
        if step in INSIDE:
            self._put_in(step, share, works)
        elif step in ("open", "close"):
            self._fold(step == "open", share, works)
        elif step == "send":
            self._send(share, works)
        else:
            self._use(step, share, works)

    def rest(self) -> None:
        """Take the hands away, more or less."""
        self.hands = [hand + self.rng.normal(0, 1.0, 2) for hand in AWAY]
        self.grip, self.carried = 0.0, None

    def _put_in(self, thing: str, share: float, works: bool) -> None:
        goal = self.box + INSIDE[thing]
        stops = [AWAY[1], self.stores[thing], goal, goal + [0, 4], AWAY[1]]
        self.hands[1], leg = along(stops, share)
        if works and thing not in self.inside | self.on_top:
            self.carried, self.grip = (thing, 1.0) if leg == 1 else (None, 0.0)
            if leg > 1:
                (self.inside if self.flaps else self.on_top).add(thing)

    def _fold(self, opens: bool, share: float, works: bool) -> None:
        for hand, side in ((0, -1), (1, 1)):
            near, far = self.box + [side * 12, 14], self.box + [side * 44, 14]
            stops = [AWAY[hand], near, far] if opens else [AWAY[hand], far, near]
            self.hands[hand], _ = along([*stops, AWAY[hand]], share)
        if works:
            part = smooth(float(np.clip(3 * share - 1, 0, 1)))
            self.flaps = max(self.flaps, part) if opens else min(self.flaps, 1 - part)

    def _use(self, tool: str, share: float, works: bool) -> None:
        """Take paper, tape or a stamp to the box, and use it there."""
        store = self.stores[tool]
        start, stop = self.box - [20, 0], self.box + [20, 0]
        if tool == "stamp":
            start = stop = self.box + [15, -11]
        if tool == "paper":
            start = stop = self.box + [0, 2]
        self.hands[1], leg = along([AWAY[1], store, start, stop, store, AWAY[1]], share)
        if 1 <= leg <= 3:
            self.carried, self.grip = tool, 1.0
        part = float(np.clip(5 * share - 2, 0, 1))
        if not works:
            return
        if tool == "paper" and self.flaps > 0:
            self.filled = max(self.filled, part)
        elif tool == "tape" and self.flaps == 0:
            self.taped = max(self.taped, part)
        elif tool == "stamp" and part > 0.5:
            self.stamped = True

    def _send(self, share: float, works: bool) -> None:
        shift = smooth(float(np.clip(2 * share - 0.5, 0, 1)))
        start = self.start
        for hand, side in ((0, -1), (1, 1)):
            hold = start + [side * 24, 12]
            up = hold + (TRAY - start)
            self.hands[hand], _ = along([AWAY[hand], hold, up, AWAY[hand]], share)
        if works:
            self.box = start + shift * (TRAY + [0, 6] - start)

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        self.clutter.draw(canvas)
        canvas.box(TRAY, (40, 12), (70, 80, 92))
        self._draw_box(canvas)
        self._lying(canvas)
        if self.carried in INSIDE:
            self._thing(canvas, self.carried, self.hands[1] + [0, -8])
        elif self.carried:
            self._tool(canvas, self.carried, self.hands[1] + [0, -8])
        for hand, away in zip(self.hands, AWAY, strict=True):
            draw_arm(canvas, hand, away + [0, 24], self.colours, grip=self.grip)
        return {"above": self.film.take(self.light.fall(canvas.image))}

    def _lying(self, canvas: Canvas) -> None:
        """Draw what is neither in the box nor in a hand."""
        for thing in ("book", "card", "mug"):
            if thing in self.on_top:
                self._thing(canvas, thing, self.box + INSIDE[thing])
            elif thing not in self.inside and thing != self.carried:
                self._thing(canvas, thing, self.stores[thing])
        for tool in ("paper", "tape", "stamp"):
            if tool != self.carried:
                self._tool(canvas, tool, self.stores[tool])

    def _draw_box(self, canvas: Canvas) -> None:
        box, flaps = self.box, self.flaps
        canvas.box(box, HALF, (188, 148, 100))
        for side in (-1, 1):
            width = HALF[0] / 2
            place = np.array([box[0] + side * (width + flaps * HALF[0]), box[1]])
            if flaps == 1:
                canvas.box(box, HALF - 3, (120, 90, 60))
                self._contents(canvas)
            canvas.box(place, (width, HALF[1]), (204, 166, 116))
            canvas.line(place - [0, HALF[1]], place + [0, HALF[1]], 1, (150, 116, 76))
        if 0 < flaps < 1:
            canvas.box(box, (HALF[0] * flaps, HALF[1] - 3), (120, 90, 60))
        if self.taped > 0:
            end = box + [-25 + 50 * self.taped, 0]
            canvas.line(box - [25, 0], end, 6, (226, 214, 170))
        if self.stamped:
            canvas.box(box + [15, -11], (5, 4), (190, 40, 60))

    def _contents(self, canvas: Canvas) -> None:
        for thing in ("book", "card", "mug"):
            if thing in self.inside:
                self._thing(canvas, thing, self.box + INSIDE[thing])
        for place in self.rustle[: round(14 * self.filled)]:
            canvas.disc(self.box + place * [9, 6], 4, (236, 230, 214))

    def _thing(self, canvas: Canvas, thing: str, place: Point) -> None:
        if thing == "book":
            canvas.box(place, (9, 12), self.cover)
            canvas.line(place + [-6, -10], place + [-6, 10], 2, (240, 236, 226))
        elif thing == "card":
            canvas.box(place, (8, 5), (244, 240, 230))
            canvas.disc(place, 2.5, (210, 60, 80))
        else:
            canvas.disc(place, 8, (60, 130, 150))
            canvas.disc(place, 5, (40, 60, 70))

    def _tool(self, canvas: Canvas, tool: str, place: Point) -> None:
        if tool == "paper":
            canvas.disc(place, 9, (238, 232, 216))
            canvas.disc(place + [3, -2], 4, (214, 206, 188))
        elif tool == "tape":
            canvas.disc(place, 8, (214, 198, 140))
            canvas.disc(place, 4, (110, 84, 60))
        else:
            canvas.box(place, (6, 6), (90, 40, 50))
            canvas.disc(place, 3, (190, 150, 110))


SCENE = Scene(
    name="parcel",
    world=Parcel,
    steps=("open", "book", "card", "paper", "close", "tape", "stamp", "send"),
    spares=("mug",),
    waits={
        "book": ("open",),
        "card": ("open",),
        "paper": ("open", "book", "card"),
        "close": ("open", "book", "card", "paper"),
        "tape": ("close",),
        "stamp": ("close",),
        "send": ("tape", "stamp"),
    },
    optional=("card",),
    cameras=("above",),
)
