"""A small MuJoCo table top with a gantry arm that is moved, not driven: no dynamics."""

from collections.abc import Sequence

import mujoco
import numpy as np

from scenes.parts.drawing import Film, Look, along
from teasim.gl import choose_gl

HOME = np.array([0.0, -0.05, 0.42])
"""Where the gripper rests [m]."""
LIFT = 0.16
"""How high things are carried [m]."""
FRAME = """
<mujoco>
  <visual><quality shadowsize="0" offsamples="0"/>
    <headlight ambient=".4 .4 .4" diffuse=".4 .4 .4"/></visual>
  <asset>
    <texture name="t" type="2d" builtin="checker" rgb1=".55 .47 .38" rgb2=".5 .43 .35" width="64"
      height="64"/>
    <material name="t" texture="t" texrepeat="5 5"/></asset>
  <worldbody>
    <light pos=".4 -.6 1.5" dir="-.3 .4 -1"/>
    <geom type="plane" size="1 1 .1" material="t"/>
    <camera name="front" pos="0 -.78 .72" xyaxes="1 0 0 0 .68 .73" fovy="38"/>
    <body name="beam" mocap="true">
      <geom type="box" size=".5 .015 .015" rgba=".35 .35 .4 1" pos="0 0 .2"/></body>
    <body name="gripper" mocap="true">
      <geom type="box" size=".014 .014 .2" pos="0 0 .23" rgba=".3 .3 .34 1"/>
      <geom type="box" size=".035 .02 .012" pos="0 0 .03" rgba=".15 .15 .17 1"/>
      <geom type="box" size=".006 .015 .022" pos=".03 0 .0" rgba=".7 .7 .7 1"/>
      <geom type="box" size=".006 .015 .022" pos="-.03 0 .0" rgba=".7 .7 .7 1"/>
      {wrist}
    </body>
    {things}
  </worldbody>
</mujoco>
"""
WRIST = '<camera name="wrist" pos="0 -.11 .12" xyaxes="1 0 0 0 .75 .66" fovy="75"/>'


class Gantry:
    """The table, the arm, and things that are bodies without joints (mocap)."""

    frame = FRAME
    """MJCF of the table and of the arm, with {things} and {wrist} to fill in."""

    def __init__(self, things: str, look: Look, rng: np.random.Generator, wrist: bool = False):
        """Build the model from the MJCF of the things."""
        choose_gl()
        text = self.frame.format(things=things, wrist=WRIST if wrist else "")
        self.model = mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.cameras = ("front", "wrist") if wrist else ("front",)
        self.films = {camera: Film(look, rng) for camera in self.cameras}
        self._renderer = mujoco.Renderer(self.model, 120, 160)
        self.hold(HOME)

    def place(self, name: str, position: np.ndarray, angle: float = 0.0) -> None:
        """Put a thing somewhere, turned about the x axis by `angle` [rad]."""
        self.pose(name, position, [np.cos(angle / 2), np.sin(angle / 2), 0, 0])

    def pose(self, name: str, position: np.ndarray, turn: Sequence[float]) -> None:
        """Put a thing somewhere, turned by a quaternion (w, x, y, z)."""
        body = self.model.body_mocapid[self.model.body(name).id]
        self.data.mocap_pos[body] = position
        self.data.mocap_quat[body] = turn

    def where(self, name: str) -> np.ndarray:
        """Return where a thing is (3,) [m]."""
        body = self.model.body_mocapid[self.model.body(name).id]
        return np.array(self.data.mocap_pos[body])

    def paint(self, geom: str, colour: tuple[float, float, float, float]) -> None:
        """Change the colour of a geom."""
        self.model.geom_rgba[self.model.geom(geom).id] = colour

    def hold(self, position: np.ndarray) -> None:
        """Move the gripper to a place [m]."""
        self.gripper = np.array(position, dtype=float)
        self.place("gripper", self.gripper + [0, 0, 0.03])
        self.place("beam", np.array([0.0, self.gripper[1], 0.45]))

    def carry(self, start: np.ndarray, goal: np.ndarray, share: float) -> int:
        """Move the gripper home, start, goal, home in arcs; return the leg, 1 while it carries."""
        up = np.array([0, 0, LIFT])
        stops = [HOME, start + up, start, start + up, goal + up, goal, goal + up, HOME]
        position, leg = along(stops, share)
        self.hold(position)
        return 0 if leg < 2 else 1 if leg < 5 else 2

    def pictures(self) -> dict[str, np.ndarray]:
        """Return (H, W, 3) uint8 RGB per camera."""
        mujoco.mj_forward(self.model, self.data)
        seen = {}
        for camera in self.cameras:
            self._renderer.update_scene(self.data, camera=camera)
            seen[camera] = self.films[camera].take(self._renderer.render())
        return seen

    def close(self) -> None:
        """Give the OpenGL context back."""
        self._renderer.close()
