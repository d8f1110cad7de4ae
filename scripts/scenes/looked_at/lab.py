"""Gloved hands fill a tube, cap it and spin it in a centrifuge, from the side in changing light."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, Point, along, smooth, table
from scenes.parts.people import Clutter, Daylight, colour_of, draw_arm
from scenes.scene import Scene

BACKGROUND = table(120, 160, (158, 168, 176), 8)
TUBE = np.array([74.0, 84.0])
LIQUIDS = {"sample": (60, 95, 225), "reagent": (245, 205, 40), "dye": (205, 40, 150)}
BOTTLES = {
    "sample": np.array([14.0, 90.0]),
    "reagent": np.array([34.0, 90.0]),
    "dye": np.array([54.0, 93.0]),
}
HOLDER = np.array([56.0, 34.0])
DISH = np.array([66.0, 112.0])
MIXER = np.array([109.0, 92.0])
ROTOR = np.array([138.0, 80.0])
BUTTON = np.array([124.0, 102.0])
SIDES = (np.array([-16.0, 34.0]), np.array([176.0, 34.0]))
LEFT_SHARE = 0.4  # of the videos in which the sample is drawn with the left hand


class Lab:
    """Bottles, a rack of tubes, a mixer, a centrifuge, and what is done with them."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Put things where they are in this video; a person uses one hand or the other."""
        self.shift = {name: rng.normal(0, 1.5) for name in ("bottles", "rack", "mixer")}
        self.levels = {name: rng.uniform(5, 9) for name in BOTTLES}
        self.others = [(colour_of(rng.integers(90, 240, 3)), rng.uniform(2, 12)) for _ in range(2)]
        self.filled = dict.fromkeys(LIQUIDS, 0.0)
        self.mixed = self.lid = self.spun = 0.0
        self.cap, self.at = "tube", "rack"
        self.held: dict[str, Point] = {}
        self.drop: str | None = None
        self.left_handed = rng.random() < LEFT_SHARE
        self.turning = 0.0
        glove = ((70, 110, 190), (150, 90, 190), (60, 150, 150))[rng.integers(3)]
        self.colours = ((206, 210, 216), glove)
        self.clutter = Clutter(np.array([[24.0, 20.0], [96, 26], [150, 20]]), 5, rng)
        self.light = Daylight(0.2, rng)
        self.film = Film(Look(light=0.14, drift=0.12, shake=0.3), rng)
        self.rng = rng
        self.rest()

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        self.rest()
        if step in LIQUIDS:
            self._pipette(step, share, works)
        elif step in ("uncap", "cap"):
            self._turn_cap(step == "uncap", share, works)
        elif step in ("open", "shut"):
            self._swing(step == "open", share, works)
        elif step == "spin":
            self._press(share, works)
        elif step == "mix":
            self._mix(share, works)
        else:
            self._load(share, works)

    def rest(self) -> None:
        """Take the hand away; the rotor turns while it has to."""
        self.hand, self.side = SIDES[1] + self.rng.normal(0, 0.5, 2), 1
        self.held, self.drop = {}, None
        self.spun += 0.05 * (0 < self.spun < 1)
        self.turning += 0.9 * (0 < self.spun < 1)

    @property
    def tube(self) -> Point:
        """Where the tube stands in the rack."""
        return TUBE + [self.shift["rack"], 0]

    def _pipette(self, liquid: str, share: float, works: bool) -> None:
        self.side = int(not (self.left_handed and liquid == "sample"))
        away = SIDES[self.side]
        bottle = BOTTLES[liquid] + [self.shift["bottles"], -42]
        over = self.tube + [0, -46]
        stops = [away, HOLDER, bottle, bottle + [0, 9], over, over + [0, 5], HOLDER, away]
        self.hand, leg = along(stops, share)
        if 1 <= leg <= 5:
            self.held["pipette"] = self.hand
        if works and 3 <= leg <= 4:
            self.drop = liquid
        if works and leg >= 4 and self.cap != "tube" and self.at == "rack":
            inside = min(1.0, max(0.0, 7 * share - 4.4) * 2)
            self.filled[liquid] = max(self.filled[liquid], inside)

    def _turn_cap(self, off: bool, share: float, works: bool) -> None:
        top, dish = self.tube + [0, -18], DISH + [self.shift["rack"], -3]
        start, stop = (top, dish) if off else (dish, top)
        stops = [SIDES[1], start, start, stop + [0, -8], stop, SIDES[1]]
        self.hand, leg = along(stops, share)
        self.hand = self.hand + [2 * np.sin(30 * share), 0]
        if not works or self.at != "rack" or self.cap not in ("tube" if off else "dish", "hand"):
            return
        if leg in (2, 3):
            self.cap, self.held["cap"] = "hand", self.hand
        if leg == 4:
            self.cap = "dish" if off else "tube"

    def _swing(self, up: bool, share: float, works: bool) -> None:
        low, high = ROTOR + [-16, -20], ROTOR + [2, -46]
        ends = [low, high] if up else [high, low]
        self.hand, leg = along([SIDES[1], *ends, SIDES[1]], share)
        if works and leg >= 1:
            done = smooth(3 * share - 1) if leg == 1 else 1.0
            self.lid = done if up else min(self.lid, 1 - done)

    def _press(self, share: float, works: bool) -> None:
        self.hand, leg = along([SIDES[1], BUTTON + [4, -4], BUTTON, SIDES[1]], share)
        if works and leg == 2 and not self.spun:
            self.spun = 0.05

    def _mix(self, share: float, works: bool) -> None:
        goal = MIXER + [self.shift["mixer"], -26]
        top = self.tube + [0, -8]
        stops = [SIDES[1], top, top + [0, -26], goal, goal, goal, top + [0, -26], top, SIDES[1]]
        self.hand, leg = along(stops, share)
        if 1 <= leg <= 6 and self.at == "rack":
            self.held["tube"] = self.hand + [0, 8]
        if leg in (3, 4):
            self.hand = self.hand + self.rng.normal(0, 1.2, 2)
            self.mixed = max(self.mixed, works * min(1.0, (8 * share - 3) / 1.6))

    def _load(self, share: float, works: bool) -> None:
        top, goal = self.tube + [0, -8], ROTOR + [0, -14]
        stops = [SIDES[1], top, top + [0, -28], goal + [0, -14], goal, SIDES[1]]
        self.hand, leg = along(stops, share)
        if not works or self.lid < 1 or (self.at == "rotor" and leg < 4):
            return
        if 1 <= leg <= 3:
            self.held["tube"] = self.hand + [0, 8]
        if leg == 4:
            self.at = "rotor"

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        canvas.box(np.array([80.0, 26.0]), (90, 2), (150, 140, 128))
        self.clutter.draw(canvas)
        canvas.box(np.array([80.0, 114.0]), (90, 9), (96, 104, 112))
        self._bottles(canvas)
        self._rack(canvas)
        self._mixer(canvas)
        self._centrifuge(canvas)
        if "tube" in self.held:
            self._tube(canvas, self.held["tube"])
        if self.cap == "dish":
            self._cap(canvas, DISH + [self.shift["rack"], -3])
        self._tool(canvas, self.held.get("pipette", HOLDER))
        if "cap" in self.held:
            self._cap(canvas, self.held["cap"])
        elbow = self.hand * 0.2 + SIDES[self.side] * 0.8 + [[-40.0, 40.0][self.side], 6]
        draw_arm(canvas, self.hand + [[-7, 7][self.side], 0], elbow, self.colours, grip=0.7)
        return {"front": self.film.take(self.light.fall(canvas.image))}

    def _bottles(self, canvas: Canvas) -> None:
        for name, place in BOTTLES.items():
            at = place + [self.shift["bottles"], 0]
            canvas.box(at, (8, 14), (222, 226, 228))
            canvas.box(at + [0, 13 - self.levels[name]], (7, self.levels[name]), LIQUIDS[name])
            canvas.box(at + [0, -16], (4, 3), (205, 210, 214))
            canvas.box(at + [0, 3], (5, 3), (250, 250, 245))

    def _rack(self, canvas: Canvas) -> None:
        middle = self.tube
        canvas.disc(DISH + [self.shift["rack"], 0], 8, (70, 76, 84))
        for number, (colour, level) in enumerate(self.others):
            at = middle + [13 * number + 14, 0]
            canvas.box(at, (4.5, 15), (228, 232, 232))
            canvas.box(at + [0, 14 - level / 2], (3, level / 2), colour)
        if self.at == "rack" and "tube" not in self.held:
            self._tube(canvas, middle)
        canvas.box(middle + [11, 17], (22, 4), (205, 120, 50))

    def _tube(self, canvas: Canvas, at: Point) -> None:
        canvas.box(at, (6.5, 16), (222, 228, 230))
        blend = sum(self.filled[name] * np.array(LIQUIDS[name]) for name in LIQUIDS)
        blend = blend / max(sum(self.filled.values()), 1e-6)
        green = np.array([40, 160, 80]) if self.filled["sample"] * self.filled["reagent"] else blend
        bottom = 14.0
        for name, amount in self.filled.items():
            if amount:
                own = (1 - self.mixed) * np.array(LIQUIDS[name]) + self.mixed * green
                canvas.box(at + [0, bottom - 4.5 * amount], (5.5, 4.5 * amount), colour_of(own))
                bottom -= 9 * amount
        if self.cap == "tube":
            self._cap(canvas, at + [0, -18])

    def _cap(self, canvas: Canvas, at: Point) -> None:
        canvas.box(at, (7, 4), (215, 60, 45))
        canvas.box(at + [0, 2], (7, 1), (160, 40, 30))

    def _mixer(self, canvas: Canvas) -> None:
        at = MIXER + [self.shift["mixer"], 6]
        canvas.box(at, (9, 8), (58, 62, 72))
        canvas.box(at + [0, -10], (6, 2), (25, 25, 28))

    def _centrifuge(self, canvas: Canvas) -> None:
        if self.at == "rotor" and "tube" not in self.held:
            self._tube(canvas, ROTOR + [0, -2])
        canvas.box(ROTOR + [0, 12], (22, 18), (196, 198, 194))
        angle = 1.5 * self.lid
        hinge, way = ROTOR + [22, -8], np.array([-np.cos(angle), -np.sin(angle)])
        if self.lid < 0.5:
            canvas.box(ROTOR + [0, -18], (21, 11), (150, 165, 185))
        canvas.line(hinge, hinge + 42 * way, 6, (70, 84, 104))
        window = ROTOR + [6, 10]
        canvas.disc(window, 11, (60, 66, 74))
        if self.at == "rotor":
            canvas.box(window, (7, 3), (235, 240, 240), self.turning)
            canvas.disc(window, 3, (210, 70, 60))
        canvas.disc(BUTTON, 3.5, (40, 130, 70))
        dark, lit = (52, 60, 54), (90, 250, 110)
        canvas.box(ROTOR + [-14, 6], (5, 4), lit if self.spun else dark)

    def _tool(self, canvas: Canvas, at: Point) -> None:
        tilt = np.array([0.0, 0.0])
        if "pipette" in self.held and self.side == 0:
            tilt = np.array([-9.0, 0.0])
        canvas.line(at + tilt + [0, -14], at + tilt / 2 + [0, 8], 6, (245, 245, 250))
        canvas.line(at + tilt + [0, -16], at + tilt + [0, -13], 4, (200, 60, 60))
        tip = LIQUIDS[self.drop] if self.drop else (225, 228, 232)
        canvas.line(at + tilt / 2 + [0, 8], at + [0, 26], 3, tip)


SCENE = Scene(
    name="lab",
    world=Lab,
    steps=("uncap", "sample", "reagent", "cap", "mix", "open", "load", "shut", "spin"),
    spares=("dye",),
    waits={
        "sample": ("uncap",),
        "reagent": ("uncap",),
        "cap": ("sample", "reagent"),
        "mix": ("cap",),
        "load": ("cap", "mix", "open"),
        "shut": ("load",),
        "spin": ("shut",),
    },
    optional=("mix",),
    seconds=2.8,
)
