"""A gantry arm at a table: a drawer, a block, a pot with a lid, switches that light lamps."""

import numpy as np

from scenes.parts.drawing import Look, along
from scenes.parts.gantry import HOME, Gantry
from scenes.scene import Scene

THINGS = """
<geom type="box" size=".09 .08 .04" pos="-.26 .16 .04" rgba=".4 .3 .22 1"/>
<body name="drawer" mocap="true">
  <geom type="box" size=".075 .07 .004" pos="0 0 .03" rgba=".65 .5 .35 1"/>
  <geom type="box" size=".08 .006 .035" pos="0 -.075 .04" rgba=".6 .42 .28 1"/>
  <geom type="box" size=".02 .008 .006" pos="0 -.088 .04" rgba=".8 .8 .3 1"/>
</body>
<body name="block" mocap="true"><geom type="box" size=".025 .025 .025" rgba=".2 .35 .8 1"/></body>
<body name="ball" mocap="true"><geom type="sphere" size=".025" rgba=".85 .85 .85 1"/></body>
<geom type="cylinder" size=".06 .035" pos=".02 .12 .035" rgba=".5 .5 .55 1"/>
<geom type="cylinder" size=".052 .002" pos=".02 .12 .071" rgba=".85 .6 .25 1"/>
<body name="lid" mocap="true"><geom type="cylinder" size=".062 .008" rgba=".25 .45 .3 1"/>
  <geom type="sphere" size=".014" pos="0 0 .018" rgba=".1 .1 .1 1"/></body>
<geom type="box" size=".12 .05 .012" pos=".26 .02 .012" rgba=".75 .75 .72 1"/>
<geom type="box" size=".015 .015 .012" pos=".2 .02 .03" rgba=".7 .15 .15 1"/>
<geom type="box" size=".015 .015 .012" pos=".32 .02 .03" rgba=".15 .2 .7 1"/>
<geom name="lamp_red" type="sphere" size=".03" pos=".2 .2 .05" rgba=".25 .12 .12 1"/>
<geom name="lamp_blue" type="sphere" size=".03" pos=".32 .2 .05" rgba=".12 .12 .25 1"/>
"""
SHUT, OPEN = np.array([-0.26, 0.16, 0.0]), np.array([-0.26, 0.05, 0.0])
HANDLE = np.array([0.0, -0.1, 0.04])
POT = np.array([0.02, 0.12, 0.08])
SWITCHES = {"red": np.array([0.2, 0.02, 0.05]), "blue": np.array([0.32, 0.02, 0.05])}
LIT = {"red": (1.0, 0.35, 0.25, 1.0), "blue": (0.35, 0.5, 1.0, 1.0)}


class Tabletop(Gantry):
    """What the arm does to the things."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Put the drawer in, block and lid and ball on the table."""
        super().__init__(THINGS, Look(light=0.1, shake=0.2), rng)
        self.block = np.array([-0.08, -0.12, 0.025]) + [*rng.uniform(-0.03, 0.03, 2), 0]
        self.lid = np.array([0.1, -0.1, 0.01]) + [*rng.uniform(-0.02, 0.02, 2), 0]
        self.ball = np.array([0.3, -0.16, 0.025]) + [*rng.uniform(-0.03, 0.03, 2), 0]
        self.inside = False
        self.place("drawer", SHUT)
        for name in ("block", "lid", "ball"):
            self.place(name, getattr(self, name))

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        if step in ("open", "shut"):
            self._slide(*((SHUT, OPEN) if step == "open" else (OPEN, SHUT)), share, works)
        elif step in SWITCHES:
            self._press(step, share, works)
        else:
            goals = {
                "block": self.where("drawer") + [0, -0.03, 0.06],
                "lid": POT,
                "ball": np.array([-0.1, 0.28, 0.025]),
            }
            self._bring(step, goals[step], share, works)

    def rest(self) -> None:
        """Stand."""
        self.hold(HOME)

    def _slide(self, start: np.ndarray, stop: np.ndarray, share: float, works: bool) -> None:
        ends = [start + HANDLE, stop + HANDLE]
        position, leg = along([HOME, *ends, HOME], share)
        self.hold(position)
        before = self.where("drawer")
        if works and leg == 1:
            self.place("drawer", position - HANDLE)
        if works and leg == 2:
            self.place("drawer", stop)
        if self.inside:
            self.place("block", self.where("block") + self.where("drawer") - before)

    def _press(self, lamp: str, share: float, works: bool) -> None:
        over = SWITCHES[lamp] + [0, 0, 0.1]
        position, leg = along([HOME, over, SWITCHES[lamp], over, HOME], share)
        self.hold(position)
        if works and leg >= 2:
            self.paint(f"lamp_{lamp}", LIT[lamp])

    def _bring(self, name: str, goal: np.ndarray, share: float, works: bool) -> None:
        leg = self.carry(getattr(self, name), goal, share)
        if works and leg == 1:
            self.place(name, self.gripper)
        if works and leg == 2:
            self.place(name, goal)
            self.inside = self.inside or name == "block"


SCENE = Scene(
    name="tabletop",
    world=Tabletop,
    steps=("open", "block", "shut", "red", "lid", "blue"),
    spares=("ball",),
    waits={"block": ("open",), "shut": ("block",)},
    seconds=2.6,
)
