"""A gantry arm packs a lunch box, seen from the front and from its wrist."""

import numpy as np

from scenes.parts.drawing import Look, along
from scenes.parts.gantry import HOME, Gantry
from scenes.scene import Scene

BOX = np.array([0.02, 0.14, 0.0])
FOOD = {
    "rice": '<geom type="box" size=".05 .034 .02" rgba=".95 .94 .9 1"/>',
    "egg": '<geom type="ellipsoid" size=".03 .022 .02" rgba=".96 .85 .55 1"/>',
    "greens": '<geom type="box" size=".034 .03 .016" rgba=".25 .55 .2 1"/>',
    "sauce": '<geom type="cylinder" size=".014 .022" rgba=".45 .12 .08 1"/>',
    "apple": '<geom type="sphere" size=".03" rgba=".75 .15 .15 1"/>',
    "lid": '<geom type="box" size=".115 .085 .006" rgba=".3 .45 .6 1"/>',
}
THINGS = """
<geom type="box" size=".12 .09 .005" pos=".02 .14 .005" rgba=".2 .3 .42 1"/>
<geom type="box" size=".12 .004 .026" pos=".02 .226 .026" rgba=".24 .36 .5 1"/>
<geom type="box" size=".12 .004 .026" pos=".02 .054 .026" rgba=".24 .36 .5 1"/>
<geom type="box" size=".004 .09 .026" pos=".136 .14 .026" rgba=".24 .36 .5 1"/>
<geom type="box" size=".004 .09 .026" pos="-.096 .14 .026" rgba=".24 .36 .5 1"/>
<body name="band" mocap="true">
  <geom type="box" size=".012 .09 .004" rgba=".85 .3 .5 1"/>
</body>
<geom type="cylinder" size=".03 .01" pos=".33 .2 .01" rgba=".5 .5 .5 1"/>
""" + "".join(f'<body name="{name}" mocap="true">{shape}</body>' for name, shape in FOOD.items())
START = {
    "rice": np.array([-0.26, -0.1, 0.02]),
    "egg": np.array([-0.13, -0.14, 0.02]),
    "greens": np.array([0.0, -0.12, 0.016]),
    "sauce": np.array([0.12, -0.14, 0.022]),
    "apple": np.array([0.22, -0.12, 0.03]),
    "lid": np.array([-0.28, 0.14, 0.006]),
    "band": np.array([0.33, 0.02, 0.004]),
}
INSIDE = {
    "rice": BOX + [-0.04, -0.04, 0.03],
    "egg": BOX + [0.06, 0.045, 0.03],
    "greens": BOX + [-0.04, 0.045, 0.026],
    "sauce": BOX + [0.09, -0.04, 0.03],
    "apple": BOX + [0.04, -0.02, 0.04],
    "lid": BOX + [0, 0, 0.058],
    "band": BOX + [0.05, 0, 0.068],
}


class Lunch(Gantry):
    """A box, a lid, a band, and food."""

    def __init__(self, rng: np.random.Generator) -> None:
        """Lay everything out."""
        super().__init__(THINGS, Look(light=0.12, shake=0.15), rng, wrist=True)
        self.start = {
            name: place + [*rng.uniform(-0.02, 0.02, 2), 0] for name, place in START.items()
        }
        for name, place in self.start.items():
            self.place(name, place)

    def move(self, step: str, share: float, works: bool) -> None:
        """See `scene.World`."""
        if step == "press":
            self._press(share, works)
            return
        leg = self.carry(self.start[step], INSIDE[step], share)
        if works and leg == 1:
            self.place(step, self.gripper)
        if works and leg == 2:
            self.place(step, INSIDE[step])

    def rest(self) -> None:
        """Stand."""
        self.hold(HOME)

    def _press(self, share: float, works: bool) -> None:
        """Press the rice flat."""
        rice = self.where("rice")
        over = rice + [0, 0, 0.12]
        position, leg = along([HOME, over, rice + [0, 0, 0.03], over, HOME], share)
        self.hold(position)
        if works and leg >= 2:
            size = self.model.geom_size[self.model.body("rice").geomadr[0]]
            size[:] = (0.066, 0.044, 0.012)


SCENE = Scene(
    name="lunch",
    world=Lunch,
    steps=("rice", "press", "egg", "greens", "sauce", "lid", "band"),
    spares=("apple",),
    waits={
        "press": ("rice",),
        "lid": ("rice", "press", "egg", "greens", "sauce"),
        "band": ("lid",),
    },
    optional=("sauce",),
    cameras=("front", "wrist"),
    seconds=2.8,
)
