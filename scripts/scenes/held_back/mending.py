"""A person mends a cloth at a table by a window, filmed from above."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, Point, along, smooth
from scenes.parts.people import Clutter, Daylight, colour_of, draw_arm, wood
from scenes.scene import Scene

BACKGROUND = wood(120, 160, (196, 170, 130), 51)
CLOTH = np.array([80.0, 56.0])
HALF = np.array([40.0, 28.0])
HOLE = CLOTH + [12, 6]
STORES = {
    "cloth": np.array([18.0, 24.0]),
    "patch": np.array([142.0, 24.0]),
    "pins": np.array([146.0, 52.0]),
    "needle": np.array([148.0, 78.0]),
    "scissors": np.array([14.0, 62.0]),
    "iron": np.array([16.0, 92.0]),
    "brush": np.array([140.0, 102.0]),
}
AWAY = (np.array([44.0, 126.0]), np.array([116.0, 126.0]))
CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


class Mending:
    """A cloth with a hole, and what mends it."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Put things where they are in this video."""
        self.stores = {name: place + rng.normal(0, 2, 2) for name, place in STORES.items()}
        self.spread = self.sewn = self.ironed = self.folded = self.brushed = 0.0
        self.patched = self.pinned = self.trimmed = False
        self.carried: str | None = None
        self.hands: list[Point] = list(AWAY)
        self.cloth = rng.integers(60, 200, 3)
        self.patch = rng.integers(40, 220, 3)
        self.creases = rng.normal(0, 1, (9, 2, 2))
        self.fluff = rng.uniform(-1, 1, (8, 2))
        skin = ((226, 184, 156), (150, 104, 76), (96, 66, 50))[rng.integers(3)]
        self.colours = (colour_of(rng.integers(30, 160, 3)), skin)
        self.clutter = Clutter(np.array([[70.0, 8.0], [108, 10], [80, 112]]), 4, rng)
        self.light = Daylight(0.2, rng)
        self.film = Film(Look(light=0.12, drift=0.1, shake=0.3), rng)
        self.rng = rng

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        self.rest()
        if step in ("spread", "fold"):
            self._stretch(step, share, works)
        else:
            self._use(step, share, works)

    def rest(self) -> None:
        """Take the hands away, more or less."""
        self.hands = [hand + self.rng.normal(0, 1.2, 2) for hand in AWAY]
        self.carried = None

    def _stretch(self, step: str, share: float, works: bool) -> None:
        """Spread the cloth with both hands, or fold it."""
        low, high = CLOTH + [0, HALF[1]], CLOTH - [0, HALF[1] - 8]
        ends = (high, low) if step == "spread" else (low, high)
        for hand, side in ((0, -26), (1, 26)):
            stops = [AWAY[hand], ends[0] + [side, 0], ends[1] + [side, 0], AWAY[hand]]
            self.hands[hand], _ = along(stops, share)
        part = smooth(float(np.clip(3 * share - 1, 0, 1)))
        if works and step == "spread":
            self.spread = max(self.spread, part)
        elif works:
            self.folded = max(self.folded, part)

    def _use(self, step: str, share: float, works: bool) -> None:
        """Fetch a tool, use it at the hole, and lay it back."""
        tool = {"pin": "pins", "sew": "needle", "trim": "scissors"}.get(step, step)
        store, hand = self.stores[tool], int(self.stores[tool][0] > 80)
        near = HOLE + ([-14, 4] if step in ("patch", "sew", "pin") else [10, 10])
        far = CLOTH - [24, 10] if step in ("iron", "brush") else HOLE + [6, 10]
        stops = [AWAY[hand], store, near, far, near, store, AWAY[hand]]
        self.hands[hand], leg = along(stops, share)
        if 1 <= leg <= 4 and not (step == "patch" and (self.patched or leg > 2)):
            self.carried = tool
        if works:
            self._effect(step, float(np.clip(3 * share - 1, 0, 1)))

    def _effect(self, step: str, part: float) -> None:
        if step in ("sew", "iron", "brush"):
            name = {"sew": "sewn", "iron": "ironed", "brush": "brushed"}[step]
            setattr(self, name, max(getattr(self, name), part))
        elif part > 0.5:
            name = {"patch": "patched", "pin": "pinned", "trim": "trimmed"}[step]
            setattr(self, name, True)

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        self.clutter.draw(canvas)
        if self.spread > 0:
            self._cloth(canvas)
        else:
            canvas.box(self.stores["cloth"], (13, 10), colour_of(self.cloth))
        for tool in ("patch", "pins", "needle", "scissors", "iron", "brush"):
            if tool != self.carried and not (tool == "patch" and self.patched):
                self._tool(canvas, tool, self.stores[tool])
        if self.carried:
            hand = self.hands[int(self.stores[self.carried][0] > 80)]
            self._tool(canvas, self.carried, hand + [0, -9])
        for hand, away in zip(self.hands, AWAY, strict=True):
            draw_arm(canvas, hand, away + [0, 22], self.colours, grip=0.6)
        return {"above": self.film.take(self.light.fall(canvas.image))}

    def _cloth(self, canvas: Canvas) -> None:
        half = HALF * [1, self.spread]
        canvas.polygon(CLOTH + CORNERS * half, colour_of(self.cloth))
        for start, end in self.creases * (1 - self.ironed):
            a, b = CLOTH + start * half / 3, CLOTH + end * half / 3
            canvas.line(a, b, 1, colour_of(0.75 * self.cloth))
        for place in self.fluff[round(8 * self.brushed) :]:
            canvas.disc(CLOTH + 0.85 * place * half, 1.6, (236, 236, 232))
        canvas.disc(HOLE, 5, (60, 46, 34))
        if self.patched:
            self._mended(canvas)
        if self.folded > 0:
            top = CLOTH + [0, HALF[1] * (1 - self.folded)]
            middle = (CLOTH - [0, HALF[1]] + top) / 2
            half = (HALF[0] + 1, float(top[1] - middle[1]) / 1 + 1)
            canvas.box(CLOTH + [0, HALF[1] - half[1] * self.folded], half, (206, 200, 190))

    def _mended(self, canvas: Canvas) -> None:
        canvas.box(HOLE, (10, 9), colour_of(self.patch))
        if self.pinned:
            for corner in CORNERS:
                canvas.disc(HOLE + corner * [8, 7], 1.8, (230, 60, 60))
        rim = np.linspace(0, 2 * np.pi, 24, endpoint=False)[: round(24 * self.sewn)]
        for angle in rim:
            canvas.disc(HOLE + [10 * np.cos(angle), 9 * np.sin(angle)], 1.3, (250, 250, 246))
        if self.sewn == 1 and not self.trimmed:
            canvas.line(HOLE + [10, 0], HOLE + [24, 9], 2, (250, 250, 246))

    def _tool(self, canvas: Canvas, tool: str, place: Point) -> None:
        if tool == "patch":
            canvas.box(place, (10, 9), colour_of(self.patch))
        elif tool == "pins":
            canvas.disc(place, 6, (150, 60, 90))
            canvas.disc(place, 2, (240, 240, 240))
        elif tool == "needle":
            canvas.disc(place, 5, (236, 234, 226))
            canvas.line(place, place - [7, 5], 2, (120, 120, 126))
        elif tool == "scissors":
            canvas.line(place - [7, 6], place + [5, 6], 2, (90, 90, 98))
            canvas.line(place - [7, -6], place + [5, -6], 2, (90, 90, 98))
            canvas.disc(place - [7, 0], 4, (40, 60, 120))
        elif tool == "iron":
            canvas.polygon(
                place + np.array([[-11, -7], [6, -7], [12, 0], [6, 7], [-11, 7]]), (70,) * 3
            )
            canvas.line(place - [8, 0], place + [4, 0], 4, (190, 60, 50))
        else:
            canvas.box(place, (11, 4), (120, 80, 50))
            canvas.box(place + [0, 4], (10, 2), (226, 214, 190))


SCENE = Scene(
    name="mending",
    world=Mending,
    steps=("spread", "patch", "pin", "sew", "trim", "iron", "fold"),
    spares=("brush",),
    waits={
        "patch": ("spread",),
        "pin": ("patch",),
        "sew": ("patch", "pin"),
        "trim": ("sew",),
        "iron": ("trim",),
        "fold": ("iron",),
    },
    optional=("pin",),
    cameras=("above",),
)
