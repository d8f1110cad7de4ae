"""A gantry arm stacks blocks from random places and clears others into a bin; two cameras."""

import numpy as np

from scenes.parts.drawing import Look
from scenes.parts.gantry import HOME, Gantry
from scenes.scene import Scene

COLOURS = {
    "red": ".8 .15 .12 1",
    "green": ".15 .6 .2 1",
    "blue": ".15 .25 .8 1",
    "white": ".9 .9 .88 1",
    "black": ".08 .08 .08 1",
}
THINGS = """
<geom type="box" size=".06 .06 .006" pos="-.15 .16 .006" rgba=".85 .8 .3 1"/>
<geom type="box" size=".08 .07 .004" pos=".2 .18 .004" rgba=".4 .4 .45 1"/>
<geom type="box" size=".08 .004 .03" pos=".2 .25 .03" rgba=".35 .35 .4 1"/>
<geom type="box" size=".08 .004 .03" pos=".2 .11 .03" rgba=".35 .35 .4 1"/>
""" + "".join(
    f'<body name="{name}" mocap="true">'
    f'<geom type="box" size=".028 .028 .022" rgba="{colour}"/></body>'
    for name, colour in COLOURS.items()
)
BASE = np.array([-0.15, 0.16, 0.034])
BIN = np.array([0.16, 0.18, 0.03])
TOWER = ("red", "green", "blue")


class Stack(Gantry):
    """Blocks, a base and a bin."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Lay the blocks out at random."""
        super().__init__(THINGS, Look(light=0.1), rng, wrist=True)
        spots = rng.permutation(len(COLOURS))
        self.start = {
            name: np.array([-0.28 + 0.14 * spot, -0.15, 0.022]) + [*rng.uniform(-0.03, 0.03, 2), 0]
            for name, spot in zip(COLOURS, spots, strict=True)
        }
        self.height = 0
        self.binned = 0
        self.goal = BASE
        for name, place in self.start.items():
            self.place(name, place)

    def move(self, step: str, share: float, works: bool) -> None:
        """Bring a block to the tower or to the bin."""
        if step in TOWER:
            goal = BASE + [0, 0, 0.044 * self.height]
        else:
            goal = BIN + [0.08 * self.binned, 0, 0]
        leg = self.carry(self.start[step], goal, share)
        if works and leg == 1:
            self.place(step, self.gripper)
        if works and leg == 2:
            self.place(step, goal)
        if works and share >= 1:
            self.height += step in TOWER
            self.binned += step not in TOWER

    def rest(self) -> None:
        """Stand."""
        self.hold(HOME)


SCENE = Scene(
    name="stack",
    world=Stack,
    steps=("red", "green", "white", "blue"),
    spares=("black",),
    waits={"green": ("red",), "blue": ("green",)},
    cameras=("front", "wrist"),
    seconds=3.2,
)
