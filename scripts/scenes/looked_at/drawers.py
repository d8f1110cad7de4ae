"""A SCARA arm at a cabinet of two drawers, a box with a lid, and a button that lights a lamp."""

import numpy as np

from scenes.parts.drawing import Look, along
from scenes.parts.gantry import HOME, Gantry
from scenes.scene import Scene

FRAME = """
<mujoco>
  <visual><quality shadowsize="0" offsamples="0"/>
    <headlight ambient=".5 .5 .5" diffuse=".4 .4 .4"/></visual>
  <asset>
    <texture name="t" type="2d" builtin="gradient" rgb1=".5 .56 .57" rgb2=".42 .49 .52" width="32"
      height="32" mark="random" markrgb=".45 .5 .52" random=".1"/>
    <material name="t" texture="t" texrepeat="6 6"/></asset>
  <worldbody>
    <light name="lamp" pos="-.5 -.5 1.4" dir=".35 .35 -1" diffuse=".6 .6 .57"/>
    <geom type="plane" size="1 1 .1" material="t"/>
    <geom type="box" size="2 .02 .5" pos="0 .62 .3" rgba=".66 .64 .58 1"/>
    <camera name="front" pos=".15 -.66 .66" xyaxes=".98 .2 0 -.12 .57 .81" fovy="44"/>
    <geom type="cylinder" size=".045 .24" pos=".42 .3 .24" rgba=".85 .85 .88 1"/>
    <body name="upper" mocap="true">
      <geom type="capsule" size=".035" fromto="0 0 0 .4 0 0" rgba=".9 .9 .92 1"/>
      <geom type="cylinder" size=".045 .04" pos=".4 0 0" rgba=".2 .4 .6 1"/></body>
    <body name="fore" mocap="true">
      <geom type="capsule" size=".026" fromto="0 0 0 .4 0 0" rgba=".9 .9 .92 1"/></body>
    <body name="gripper" mocap="true">
      <geom type="cylinder" size=".012 .2" pos="0 0 .23" rgba=".6 .6 .64 1"/>
      <geom type="box" size=".036 .018 .012" pos="0 0 .03" rgba=".2 .4 .6 1"/>
      <geom type="box" size=".006 .015 .022" pos=".032 0 .0" rgba=".15 .15 .15 1"/>
      <geom type="box" size=".006 .015 .022" pos="-.032 0 .0" rgba=".15 .15 .15 1"/>
      {wrist}
    </body>
    {things}
  </worldbody>
</mujoco>
"""
DRAWER = """
<body name="{name}" mocap="true">
  <geom type="box" size=".066 .06 .004" pos="0 .0 .02" rgba=".8 .72 .55 1"/>
  <geom type="box" size=".004 .06 .024" pos=".064 0 .04" rgba=".74 .64 .46 1"/>
  <geom type="box" size=".004 .06 .024" pos="-.064 0 .04" rgba=".74 .64 .46 1"/>
  <geom type="box" size=".074 .006 .036" pos="0 -.064 .042" rgba="{colour}"/>
  <geom type="box" size=".022 .009 .006" pos="0 -.078 .048" rgba=".1 .1 .1 1"/>
</body>
"""
THINGS = (
    DRAWER.format(name="left", colour=".62 .3 .22 1")
    + DRAWER.format(name="right", colour=".25 .42 .3 1")
    + """
<geom type="box" size=".165 .075 .006" pos="-.21 .2 .088" rgba=".55 .42 .3 1"/>
<geom type="box" size=".165 .006 .04" pos="-.21 .27 .045" rgba=".45 .34 .24 1"/>
<geom type="box" size=".006 .075 .044" pos="-.369 .2 .044" rgba=".5 .38 .27 1"/>
<geom type="box" size=".006 .075 .044" pos="-.21 .2 .044" rgba=".5 .38 .27 1"/>
<geom type="box" size=".006 .075 .044" pos="-.051 .2 .044" rgba=".5 .38 .27 1"/>
<geom type="box" size=".07 .06 .004" pos=".09 .14 .004" rgba=".35 .35 .5 1"/>
<geom type="box" size=".004 .06 .03" pos=".16 .14 .03" rgba=".4 .4 .58 1"/>
<geom type="box" size=".004 .06 .03" pos=".02 .14 .03" rgba=".4 .4 .58 1"/>
<geom type="box" size=".07 .004 .03" pos=".09 .2 .03" rgba=".4 .4 .58 1"/>
<geom type="box" size=".07 .004 .03" pos=".09 .08 .03" rgba=".4 .4 .58 1"/>
<body name="lid" mocap="true"><geom type="box" size=".076 .066 .006" rgba=".75 .75 .85 1"/>
  <geom type="box" size=".012 .012 .012" pos="0 0 .016" rgba=".15 .15 .2 1"/></body>
<body name="cube" mocap="true"><geom type="box" size=".032 .032 .03" rgba=".9 .75 .15 1"/></body>
<body name="can" mocap="true">
  <geom type="cylinder" size=".031 .032" rgba=".8 .12 .15 1"/></body>
<body name="ball" mocap="true"><geom type="sphere" size=".036" rgba=".2 .4 .9 1"/></body>
<body name="cone" mocap="true">
  <geom type="ellipsoid" size=".03 .03 .05" rgba=".85 .3 .75 1"/></body>
<geom type="box" size=".045 .045 .012" pos=".3 .05 .012" rgba=".8 .8 .78 1"/>
<geom type="cylinder" size=".022 .012" pos=".3 .05 .03" rgba=".85 .2 .15 1"/>
<geom type="cylinder" size=".008 .06" pos=".27 .26 .06" rgba=".3 .3 .3 1"/>
<geom name="bulb" type="sphere" size=".042" pos=".27 .26 .15" rgba=".22 .24 .2 1"/>
<body name="rag" mocap="true"><geom type="box" size=".05 .03 .003" rgba=".6 .6 .4 1"/></body>
"""
)
COLUMN, ARM = np.array([0.42, 0.3]), 0.4
IN = {"left": np.array([-0.29, 0.2, 0.0]), "right": np.array([-0.13, 0.2, 0.0])}
PULL = np.array([0.0, -0.12, 0.0])
HANDLE = np.array([0.0, -0.09, 0.06])
BOX = np.array([0.09, 0.14, 0.04])
BUTTON = np.array([0.3, 0.05, 0.045])
SPOTS = (-0.3, -0.14, 0.02, 0.18)  # x where things stand at the front edge [m]


class Drawers(Gantry):
    """A cabinet, a box, a lamp, and things that stand at random places.

    `aim` is where a thing is brought in the present step, and `sliding` tells whether a drawer
    moves in it.
    """

    frame = FRAME

    def __init__(self, rng: np.random.Generator) -> None:
        """Shut everything; put the things at random places, and the camera and the light."""
        super().__init__(THINGS, Look(light=0.12, shake=0.3, drift=0.06), rng)
        spots = rng.permutation(SPOTS)
        self.start = {
            name: np.array([x, -0.14, 0.03]) + [*rng.uniform(-0.035, 0.035, 2), 0]
            for name, x in zip(("cube", "can", "ball", "cone"), spots, strict=True)
        }
        self.start["lid"] = np.array([0.31, -0.08, 0.008]) + [*rng.uniform(-0.02, 0.02, 2), 0]
        self.inside = {"left": False, "right": False}
        self.covered = self.sliding = False
        self.aim: np.ndarray | None = None
        for name, place in (self.start | IN).items():
            self.place(name, place)
        turn = rng.uniform(0, np.pi)
        rag = np.array([rng.uniform(-0.35, 0.1), rng.uniform(-0.08, -0.03), 0.004])
        self.pose("rag", rag, [np.cos(turn), 0, 0, np.sin(turn)])
        self.model.cam_pos[0] += rng.normal(0, 0.012, 3)
        self.model.light_pos[0] += rng.normal(0, 0.25, 3) * [1, 1, 0.3]
        self.rng = rng

    def hold(self, position: np.ndarray) -> None:
        """Move the gripper to a place [m], with the links of the arm above it."""
        self.gripper = np.array(position, dtype=float)
        self.place("gripper", self.gripper + [0, 0, 0.03])
        way = self.gripper[:2] - COLUMN
        reach = min(float(np.linalg.norm(way)), 1.999 * ARM)
        bend = np.arccos(reach / (2 * ARM))
        towards = np.arctan2(way[1], way[0])
        elbow = COLUMN + ARM * np.array([np.cos(towards - bend), np.sin(towards - bend)])
        for name, at, turn in (
            ("upper", [*COLUMN, 0.5], towards - bend),
            ("fore", [*elbow, 0.45], towards + bend),
        ):
            self.pose(name, np.array(at), [np.cos(turn / 2), 0, 0, np.sin(turn / 2)])

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        verb, _, side = step.partition("_")
        if side:
            self._slide(side, verb == "open", share, works)
        elif step == "button":
            self._press(share, works)
        else:
            self._bring(step, share, works)

    def rest(self) -> None:
        """Stand."""
        self.hold(HOME + self.rng.normal(0, 0.002, 3))
        self.sliding, self.aim = False, None

    def _slide(self, side: str, pull: bool, share: float, works: bool) -> None:
        start, stop = (IN[side], IN[side] + PULL) if pull else (IN[side] + PULL, IN[side])
        back = np.array([0, -0.05, 0.1])
        ends = [start + HANDLE + back, start + HANDLE, stop + HANDLE, stop + HANDLE + back]
        position, leg = along([HOME, *ends, HOME], share)
        self.hold(position)
        before = self.where(side)
        if works and leg == 2 and np.allclose(before, start):
            self.sliding = True
        if leg >= 2 and self.sliding:
            self.place(side, position - HANDLE if leg == 2 else stop)
        if self.inside[side]:
            thing = "cube" if side == "left" else "can"
            self.place(thing, self.where(thing) + self.where(side) - before)

    def _press(self, share: float, works: bool) -> None:
        over = BUTTON + [0, 0, 0.1]
        position, leg = along([HOME, over, BUTTON, over, HOME], share)
        self.hold(position)
        if works and leg >= 2:
            self.paint("bulb", (1.0, 0.93, 0.45, 1.0))

    def _goal(self, name: str) -> np.ndarray:
        """Return where a thing is brought: on top of what is shut."""
        side = {"cube": "left", "can": "right"}.get(name)
        if side:
            is_open = self.where(side)[1] < IN[side][1] - 0.05
            return self.where(side) + ([0, -0.01, 0.05] if is_open else [0, 0.02, 0.12])
        if name == "ball":
            return BOX + [0, 0, 0.05 if self.covered else 0.0]
        return BOX + [0, 0, 0.026] if name == "lid" else np.array([-0.21, 0.21, 0.14])

    def _bring(self, name: str, share: float, works: bool) -> None:
        if self.aim is None:
            self.aim = self._goal(name)
        leg = self.carry(self.start[name], self.aim, share)
        if works and leg == 1:
            self.place(name, self.gripper)
        if works and leg == 2:
            self.place(name, self.aim)
        if share >= 1:
            side = {"cube": "left", "can": "right"}.get(name)
            if works and side and self.where(name)[2] < 0.1:
                self.inside[side] = True
            self.covered |= works and name == "lid"


SCENE = Scene(
    name="drawers",
    world=Drawers,
    steps=(
        *("open_left", "cube", "shut_left", "open_right", "can", "shut_right"),
        *("ball", "lid", "button"),
    ),
    spares=("cone",),
    waits={
        "cube": ("open_left",),
        "shut_left": ("cube",),
        "can": ("open_right",),
        "shut_right": ("can",),
        "lid": ("ball",),
    },
    optional=("button",),
    seconds=2.8,
)
