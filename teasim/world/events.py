"""Sub-tasks recognised from what physically happened, never from what a script meant to do."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np

from teasim.constants import ARMS
from teasim.world.liquids import CUP_FLOOR, RIM_HEIGHT, VESSELS, Liquids
from teasim.world.state import Saved
from teasim.world.station import body_name

KNOB_ON = np.radians(60)
"""The oven is on once its knob was turned beyond this angle [rad]."""
KNOB_OFF = np.radians(20)
"""The oven is off once its knob was turned back below this angle [rad]."""
SERVING = 0.6
"""Share of a vessel's filling that must reach the cup to count as added."""
BAG_RADIUS = 0.036
"""The tea bag is in the cup when its middle is this near to the cup's axis [m]."""
STIR_TURNS = 2.0
"""Turns of the spoon in the liquid that count as stirred."""
STIR_RADIUS = 0.004
"""Nearer to the cup's axis the direction of the spoon says nothing [m]."""

_NEAR = 2 * math.hypot(BAG_RADIUS, RIM_HEIGHT)  # nothing in the cup is farther from its foot [m]
_ADDED = {"water": "add_water", "milk": "add_milk", "sugar": "add_sugar"}


@dataclass(frozen=True)
class Event:
    """A sub-task that was completed."""

    subtask: str
    """Name of the sub-task."""
    time: float
    """When it was completed [s]."""


class Recogniser(Saved):
    """Watches knob, cup, bag and spoon, and writes down the sub-tasks that happen."""

    SAVED = ("events", "oven_on", "bag_in_cup", "stirring", "_counted", "_angle", "_turned")

    def __init__(self, model: mujoco.MjModel) -> None:
        self._knob = model.joint("knob").qposadr[0]
        self._cup = model.body(body_name("cup")).id
        self._bag = model.body(body_name("tea_bag")).id
        self._tip = model.site("spoon/tip").id
        self._pads = np.array([model.geom(f"{arm}_pad_{p}").id for arm in ARMS for p in "ab"])
        self._geom_body = model.geom_bodyid
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.events: list[Event] = []
        self.oven_on = False
        self.bag_in_cup = False
        self.stirring = False
        self._counted = dict.fromkeys(_ADDED, 0.0)
        self._angle: float | None = None
        self._turned = 0.0

    def update(self, data: mujoco.MjData, liquids: Liquids) -> None:
        """Look at the station once."""
        self._watch_knob(data)
        self._watch_cup(data, liquids)
        self._watch_bag(data)
        self._watch_spoon(data, liquids)

    def _record(self, subtask: str, data: mujoco.MjData) -> None:
        self.events.append(Event(subtask, float(data.time)))

    def _watch_knob(self, data: mujoco.MjData) -> None:
        angle = data.qpos[self._knob]
        if not self.oven_on and angle > KNOB_ON:
            self.oven_on = True
            self._record("turn_on_oven", data)
        elif self.oven_on and angle < KNOB_OFF:
            self.oven_on = False
            self._record("turn_off_oven", data)

    def _watch_cup(self, data: mujoco.MjData, liquids: Liquids) -> None:
        for vessel in VESSELS.values():
            added = liquids.cup[vessel.content] - self._counted[vessel.content]
            if added >= SERVING * vessel.filling:
                self._counted[vessel.content] = liquids.cup[vessel.content]
                self._record(_ADDED[vessel.content], data)

    def _watch_bag(self, data: mujoco.MjData) -> None:
        middle = self._in_cup_frame(data.xipos[self._bag], data)
        inside = math.hypot(*middle[:2]) < BAG_RADIUS and 0 < middle[2] < RIM_HEIGHT
        if not inside:
            self.bag_in_cup = False
        elif not self.bag_in_cup and not self._held(self._bag, data):
            self.bag_in_cup = True
            self._record("add_tea_bag", data)

    def _watch_spoon(self, data: mujoco.MjData, liquids: Liquids) -> None:
        tip = self._in_cup_frame(data.site_xpos[self._tip], data)
        radius = math.hypot(*tip[:2])
        dipped = radius < BAG_RADIUS and 0 < tip[2] < CUP_FLOOR + liquids.depth
        before = self._angle
        self._angle = math.atan2(tip[1], tip[0]) if dipped else None
        self.stirring = False
        if before is None or self._angle is None:
            self._turned = self._turned if dipped else 0.0
            return
        step = (self._angle - before + np.pi) % (2 * np.pi) - np.pi
        self.stirring = abs(step) > 0.01
        if radius < STIR_RADIUS:
            return
        earlier = abs(self._turned)
        self._turned += step
        if earlier < 2 * np.pi * STIR_TURNS <= abs(self._turned):
            self._record("stir", data)

    def _in_cup_frame(self, point: np.ndarray, data: mujoco.MjData) -> tuple[float, float, float]:
        """A point's place in the cup [m]; infinitely far if it is not near."""
        # For three numbers Python is three times as fast as NumPy.
        px, py, pz = point.tolist()
        cx, cy, cz = data.xpos[self._cup].tolist()
        dx, dy, dz = px - cx, py - cy, pz - cz
        if dx * dx + dy * dy + dz * dz > _NEAR * _NEAR:
            return math.inf, math.inf, math.inf
        a, b, c, d, e, f, g, h, i = data.xmat[self._cup].tolist()
        return a * dx + d * dy + g * dz, b * dx + e * dy + h * dz, c * dx + f * dy + i * dz

    def _held(self, body: int, data: mujoco.MjData) -> bool:
        pairs = data.contact.geom
        if not len(pairs):
            return False
        touches = np.isin(pairs, self._pads).any(axis=1)
        return bool((touches & (self._geom_body[pairs] == body).any(axis=1)).any())
