"""Two hands of a person make a salad at a chopping board, filmed from above by daylight."""

import numpy as np

from scenes.parts.drawing import Canvas, Film, Look, Point, along
from scenes.parts.people import Clutter, Daylight, colour_of, draw_arm, wood
from scenes.scene import Scene

BACKGROUND = wood(120, 160, (150, 120, 92), 6)
BOARD, BOWL = np.array([50.0, 70.0]), np.array([127.0, 62.0])
AWAY = (np.array([36.0, 142.0]), np.array([112.0, 142.0]))
STORES = {
    "lettuce": np.array([18.0, 20.0]),
    "cucumber": np.array([54.0, 16.0]),
    "tomato": np.array([86.0, 18.0]),
    "feta": np.array([112.0, 16.0]),
    "onion": np.array([146.0, 98.0]),
    "oil": np.array([146.0, 18.0]),
    "knife": np.array([98.0, 72.0]),
    "spoon": np.array([104.0, 102.0]),
}
SPOTS = {"lettuce": BOARD + [-20, -2], "cucumber": BOARD + [19, 0]}
COLOURS = {
    "lettuce": (90, 165, 60),
    "cucumber": (205, 228, 165),
    "tomato": (205, 45, 35),
    "feta": (248, 246, 236),
    "onion": (140, 50, 130),
}
PIECES = 8  # of each ingredient in the bowl
SCOOPED = {"leaves": "lettuce", "rounds": "cucumber"}
CUTS = {"lettuce": "tear", "cucumber": "slice"}


class Salad:
    """A board, a bowl, what goes into it, tools, and two hands with sleeves."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Lay things out; the hands differ from person to person."""
        self.stores = {name: place + rng.normal(0, 1.8, 2) for name, place in STORES.items()}
        self.spots = {name: place + rng.normal(0, 1.5, 2) for name, place in SPOTS.items()}
        self.where = dict.fromkeys(COLOURS, "store")
        self.state = dict.fromkeys(("tear", "slice", "oil"), 0.0)
        self.mix = dict.fromkeys(COLOURS, 0.0)
        self.held: dict[str, Point] = {}
        skin = colour_of(np.array([215, 165, 135]) * rng.uniform(0.55, 1.1))
        self.colours = (colour_of(rng.integers(40, 210, 3)), skin)
        self.tempo = np.exp(rng.normal(0, 0.12))
        angles = np.linspace(0, 2 * np.pi, len(COLOURS), endpoint=False)
        self.heaps = {
            name: 8.5 * np.array([np.cos(a), np.sin(a)]) + rng.normal(0, 2.8, (PIECES, 2))
            for name, a in zip(COLOURS, angles, strict=True)
        }
        turns = rng.uniform(0, 2 * np.pi, (len(COLOURS), PIECES))
        radii = 17 * np.sqrt(rng.uniform(0, 1, (len(COLOURS), PIECES)))
        mixed = np.stack([radii * np.cos(turns), radii * np.sin(turns)], axis=-1)
        self.mixed = dict(zip(COLOURS, mixed, strict=True))
        self.clutter = Clutter(np.array([[10.0, 104], [154, 52], [70, 112]]), 3, rng)
        self.light, self.film = Daylight(0.1, rng), Film(Look(shake=0.5, light=0.1), rng)
        self.rng = rng
        self.rest()

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        share = share**self.tempo
        self.rest()
        if step in SCOOPED:
            self._scoop(SCOOPED[step], share, works)
        elif step == "tear":
            self._tear(share, works)
        elif step in ("slice", "oil", "toss"):
            self._use(step, share, works)
        else:
            self._bring(step, share, works)

    def rest(self) -> None:
        """Take the hands away, more or less."""
        self.hands = [hand + self.rng.normal(0, 1.0, 2) for hand in AWAY]
        self.grip = 0.0
        self.held = {}

    def _bring(self, food: str, share: float, works: bool) -> None:
        """Fetch food and lay it on the board or into the bowl."""
        hand = int(food != "lettuce")
        goal = self.spots.get(food, BOWL)
        stops = [AWAY[hand], self.stores[food], goal, goal + [0, -3], AWAY[hand]]
        self.hands[hand], leg = along(stops, share)
        self._pass(food, ("store", "board" if food in SPOTS else "bowl"), works, (leg, 1))

    def _scoop(self, food: str, share: float, works: bool) -> None:
        """Carry what lies on the board to the bowl with both hands."""
        spot = self.spots[food]
        middle, leg = along([(AWAY[0] + AWAY[1]) / 2, spot, spot, BOWL, BOWL, AWAY[1]], share)
        self.hands = [middle + [-10, 6], middle + [10, 6]]
        self._pass(food, ("board", "bowl"), works, (leg, 2))

    def _pass(self, food: str, ends: tuple[str, str], works: bool, legs: tuple[int, int]) -> None:
        """Let food be held on one leg, and lie at its end afterwards."""
        leg, carrying = legs
        start, stop = ends
        if not works or self.where[food] not in (start, "held"):
            return
        self.grip = float(leg == carrying)
        if leg == carrying:
            self.where[food] = "held"
            self.held[food] = np.mean(self.hands, axis=0) if start == "board" else self._palm(food)
        elif leg > carrying:
            self.where[food] = stop

    def _palm(self, food: str) -> Point:
        return np.asarray(self.hands[int(food != "lettuce")]) + [0, -9]

    def _tear(self, share: float, works: bool) -> None:
        spot = self.spots["lettuce"]
        pull = 6 * (1 - np.cos(share * 8 * np.pi)) / 2
        for hand, side in ((0, -1), (1, 1)):
            near = spot + [side * 9, 6]
            self.hands[hand], leg = along([AWAY[hand], near, near, near, near, AWAY[hand]], share)
            self.hands[hand] = self.hands[hand] + np.array([side * pull, 0]) * (0 < leg < 4)
        if works and self.where["lettuce"] == "board":
            self.state["tear"] = max(self.state["tear"], min(1.0, max(0.0, 2 * share - 0.6)))

    def _use(self, step: str, share: float, works: bool) -> None:
        """Take a tool, work with it, lay it back."""
        tool = {"slice": "knife", "oil": "oil", "toss": "spoon"}[step]
        place = self.spots["cucumber"] if step == "slice" else BOWL
        store = self.stores[tool]
        grasp = store + [0, 12 if tool != "oil" else 6]
        stops = [AWAY[1], grasp, place + [4, 14], place + [4, 14], place + [4, 14], grasp, AWAY[1]]
        self.hands[1], leg = along(stops, share)
        if leg in (2, 3):
            turn = 6 * np.pi * (share * 6 - 2) / 2
            round_about = np.array([7 * np.sin(turn), 5 * np.cos(turn)])
            chop = np.array([10 - 22 * (share * 6 - 2) / 2, 4 * np.cos(2 * turn)])
            self.hands[1] = self.hands[1] + (chop if step == "slice" else round_about)
        if step == "slice":
            near = place + [-15, 10]
            self.hands[0], _ = along([AWAY[0], near, near, near, AWAY[0]], share)
        if 1 <= leg <= 4:
            self.grip = 1.0
            self.held[tool] = self.hands[1] + (store - grasp)
        there = step != "slice" or self.where["cucumber"] == "board"
        if works and there and leg >= 2:
            done = min(1.0, (share * 6 - 2) / 2)
            if step == "toss":
                inside = [food for food, at in self.where.items() if at == "bowl"]
                self.mix |= {food: max(self.mix[food], done) for food in inside}
            else:
                self.state[step] = max(self.state[step], done)

    def pictures(self) -> dict[str, np.ndarray]:
        """See `scene.World`."""
        canvas = Canvas(BACKGROUND)
        self.clutter.draw(canvas)
        canvas.box(BOARD, (42, 27), (196, 160, 110))
        for k in range(5):
            canvas.line(BOARD + [-36 + 15 * k, -20], BOARD + [-30 + 16 * k, 21], 1, (178, 142, 95))
        canvas.box(self.stores["tomato"], (11, 8), (90, 105, 125))
        canvas.box(self.stores["feta"], (10, 8), (70, 90, 110))
        canvas.disc(self.stores["onion"], 9, (225, 222, 205))
        self._bowl(canvas)
        for food, at in self.where.items():
            if at != "bowl":
                spot = self.held.get(food) if at == "held" else None
                place = self.spots[food] if at == "board" else self.stores[food]
                self._food(canvas, food, place if spot is None else spot)
        for tool in ("knife", "spoon", "oil"):
            self._tool(canvas, tool, self.held.get(tool, self.stores[tool]))
        for hand, away in zip(self.hands, AWAY, strict=True):
            draw_arm(canvas, hand, away + [0, 26], self.colours, grip=self.grip)
        return {"front": self.film.take(self.light.fall(canvas.image))}

    def _bowl(self, canvas: Canvas) -> None:
        canvas.disc(BOWL, 26, (70, 110, 150))
        canvas.disc(BOWL, 23, (215, 222, 228))
        inside = [food for food, at in self.where.items() if at == "bowl"]
        whole = [food for food in inside if self.state.get(CUTS.get(food, ""), 1.0) == 0]
        for food in whole:
            self._food(canvas, food, BOWL + self.heaps[food].mean(axis=0) / 2)
        for number in range(PIECES):
            for food in inside:
                if food not in whole:
                    heap, mixed = self.heaps[food][number], self.mixed[food][number]
                    self._piece(canvas, food, BOWL + heap + self.mix[food] * (mixed - heap))
        for number in range(round(12 * self.state["oil"])):
            turn = 2.4 * number
            place = BOWL + 5.2 * np.sqrt(number + 0.5) * np.array([np.cos(turn), np.sin(turn)])
            canvas.disc(place, 2.6, (228, 180, 30))

    def _piece(self, canvas: Canvas, food: str, place: Point) -> None:
        if food == "onion":
            canvas.disc(place, 3.6, COLOURS[food])
            canvas.disc(place, 1.8, (235, 215, 232))
        elif food == "cucumber":
            canvas.disc(place, 3.8, (60, 115, 50))
            canvas.disc(place, 2.9, COLOURS[food])
        elif food == "feta":
            canvas.box(place, (2.6, 2.6), COLOURS[food], 0.5)
        else:
            canvas.disc(place, 4.6 if food == "lettuce" else 3.4, COLOURS[food])

    def _food(self, canvas: Canvas, food: str, place: Point) -> None:
        if food == "lettuce":
            apart = 1 + 1.3 * self.state["tear"]
            for k in range(9):
                turn = 2.4 * k
                spot = place + apart * 2.7 * np.sqrt(k) * np.array([np.cos(turn), np.sin(turn)])
                canvas.disc(spot, 5.5 - 1.2 * self.state["tear"], (70 + 8 * k, 150 + 6 * k, 55))
            if not self.state["tear"]:
                canvas.disc(place, 5, (170, 210, 110))
        elif food == "cucumber":
            slices = round(7 * self.state["slice"])
            if slices < 7:
                end = place + [14 - 4.6 * slices, 0]
                canvas.line(place - [16, 0], end, 10, (50, 110, 45))
            for k in range(slices):
                self._piece(canvas, food, place + [17 - 5.8 * k, 5 * (k % 2) - 2])
        else:
            for k in range(6):
                self._piece(canvas, food, place + [6 * (k % 3) - 6, 6 * (k // 3) - 3])

    def _tool(self, canvas: Canvas, tool: str, place: Point) -> None:
        if tool == "knife":
            canvas.polygon(place + np.array([[-2, 6], [-2, -14], [3, -8], [3, 6]]), (205, 210, 215))
            canvas.line(place + [0, 6], place + [0, 16], 4, (35, 30, 30))
        elif tool == "spoon":
            canvas.line(place + [0, -6], place + [0, 16], 3, (120, 75, 40))
            canvas.disc(place + [0, -9], 5, (130, 82, 45))
        else:
            canvas.disc(place, 8, (60, 80, 35))
            canvas.disc(place, 3.5, (225, 190, 60))


SCENE = Scene(
    name="salad",
    world=Salad,
    steps=(
        *("lettuce", "tear", "leaves", "cucumber", "slice", "rounds"),
        *("tomato", "feta", "oil", "toss"),
    ),
    spares=("onion",),
    waits={
        "tear": ("lettuce",),
        "leaves": ("tear",),
        "slice": ("cucumber",),
        "rounds": ("slice",),
        "oil": ("leaves", "tomato"),
        "toss": ("leaves", "rounds", "tomato", "feta", "oil"),
    },
    optional=("feta",),
    seconds=2.6,
)
