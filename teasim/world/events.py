"""Sub-tasks recognised from what happens physically, never from what a script means to do."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Protocol

import mujoco
import numpy as np

from teasim.constants import ARMS
from teasim.task.subtasks import ROWS, Dropped, Poured, Stirred, Turned
from teasim.world.liquids import CUP_BASE, RIM_HEIGHT, VESSELS, Liquids
from teasim.world.state import Saved
from teasim.world.station import body_name

SERVING = 0.6
"""Share of a vessel's filling that must reach the cup to count as added."""
BAG_RADIUS = 0.036
"""A thing is in the cup when its middle is this near to the cup's axis [m]."""
STIR_TURNS = 2.0
"""Turns of the spoon in the liquid that count as stirred."""
STIR_RADIUS = 0.004
"""Nearer to the cup's axis the direction of the spoon is not evaluated [m]."""
STIR_STEP = 0.01
"""The spoon stirs when it turns further than this in one update [rad]."""

_NEAR = 2 * math.hypot(BAG_RADIUS, RIM_HEIGHT)  # nothing in the cup is farther from its foot [m]


@dataclass(frozen=True)
class Event:
    """A sub-task that was completed."""

    subtask: str
    """Name of the sub-task."""
    time: float
    """When it was completed [s]."""


class Watcher(Protocol):
    """Watches a station for one physical event."""

    def happened(self, data: mujoco.MjData, liquids: Liquids) -> bool:
        """Look at the station once; whether the event has just happened."""

    def state(self) -> dict[str, Any]:
        """Everything that changes, as copies by name."""

    def restore(self, state: Mapping[str, Any]) -> None:
        """Return to what `state()` gave."""


class TurnWatcher(Saved):
    """Watches for `Turned`."""

    SAVED = ("_armed",)

    def __init__(self, event: Turned, model: mujoco.MjModel) -> None:
        self._event = event
        self._joint = model.joint(event.joint).qposadr[0]
        self._sign = 1 if event.reached > event.set_back else -1
        # What the model's rest pose has reached already has to be set back first.
        self._armed = bool(self._sign * model.qpos0[self._joint] < self._sign * event.reached)

    def happened(self, data: mujoco.MjData, liquids: Liquids) -> bool:  # noqa: ARG002
        """Look at the joint once."""
        angle = self._sign * data.qpos[self._joint]
        if self._armed and angle > self._sign * self._event.reached:
            self._armed = False
            return True
        self._armed = bool(self._armed or angle < self._sign * self._event.set_back)
        return False


class PourWatcher(Saved):
    """Watches for `Poured`."""

    SAVED = ("_counted",)

    def __init__(self, event: Poured, model: mujoco.MjModel) -> None:  # noqa: ARG002
        self._content = event.content
        (filling,) = (v.filling for v in VESSELS.values() if v.content == event.content)
        self._serving = SERVING * filling
        self._counted = 0.0

    def happened(self, data: mujoco.MjData, liquids: Liquids) -> bool:  # noqa: ARG002
        """Look into the cup once."""
        amount = liquids.cup[self._content]
        if amount - self._counted < self._serving:
            return False
        self._counted = amount
        return True


class DropWatcher(Saved):
    """Watches for `Dropped`."""

    SAVED = ("inside",)

    def __init__(self, event: Dropped, model: mujoco.MjModel) -> None:
        self.thing = event.thing
        """Name of the thing."""
        self._cup = model.body(body_name("cup")).id
        self._body = model.body(body_name(event.thing)).id
        self._pads = np.array([model.geom(f"{arm}_pad_{p}").id for arm in ARMS for p in "ab"])
        self._geom_body = model.geom_bodyid
        self.inside = False
        """Whether the thing is in the cup and has been let go there."""

    def happened(self, data: mujoco.MjData, liquids: Liquids) -> bool:  # noqa: ARG002
        """Look at the thing once."""
        middle = _in_frame(self._cup, data.xipos[self._body], data)
        if not (math.hypot(*middle[:2]) < BAG_RADIUS and 0 < middle[2] < RIM_HEIGHT):
            self.inside = False
        elif not self.inside and not self._held(data):
            self.inside = True
            return True
        return False

    def _held(self, data: mujoco.MjData) -> bool:
        pairs = data.contact.geom
        if not len(pairs):
            return False
        touches = np.isin(pairs, self._pads).any(axis=1)
        return bool((touches & (self._geom_body[pairs] == self._body).any(axis=1)).any())


class StirWatcher(Saved):
    """Watches for `Stirred`."""

    SAVED = ("stirring", "_angle", "_turned")

    def __init__(self, event: Stirred, model: mujoco.MjModel) -> None:
        self._cup = model.body(body_name("cup")).id
        self._tip = model.site(event.site).id
        self.stirring = False
        """Whether the site moves round in the liquid now."""
        self._angle: float | None = None
        self._turned = 0.0

    def happened(self, data: mujoco.MjData, liquids: Liquids) -> bool:
        """Look at the site once."""
        tip = _in_frame(self._cup, data.site_xpos[self._tip], data)
        radius = math.hypot(*tip[:2])
        dipped = radius < BAG_RADIUS and 0 < tip[2] < CUP_BASE + liquids.depth
        before = self._angle
        self._angle = math.atan2(tip[1], tip[0]) if dipped else None
        self.stirring = False
        if before is None or self._angle is None:
            self._turned = self._turned if dipped else 0.0
            return False
        step = (self._angle - before + np.pi) % (2 * np.pi) - np.pi
        self.stirring = abs(step) > STIR_STEP
        if radius < STIR_RADIUS:
            return False
        earlier = abs(self._turned)
        self._turned += step
        return earlier < 2 * np.pi * STIR_TURNS <= abs(self._turned)


def _in_frame(body: int, point: np.ndarray, data: mujoco.MjData) -> tuple[float, float, float]:
    """Return the coordinates of a point in a body's frame [m]; infinite if it is not near."""
    # For three numbers Python is three times as fast as NumPy.
    px, py, pz = point.tolist()
    cx, cy, cz = data.xpos[body].tolist()
    dx, dy, dz = px - cx, py - cy, pz - cz
    if dx * dx + dy * dy + dz * dz > _NEAR * _NEAR:
        return math.inf, math.inf, math.inf
    a, b, c, d, e, f, g, h, i = data.xmat[body].tolist()
    return a * dx + d * dy + g * dz, b * dx + e * dy + h * dz, c * dx + f * dy + i * dz


WATCHERS: Mapping[type, Any] = MappingProxyType(
    {Turned: TurnWatcher, Poured: PourWatcher, Dropped: DropWatcher, Stirred: StirWatcher}
)
"""What watches for each kind of physical event of `teasim.task.subtasks`."""


class Recogniser(Saved):
    """Watches for the events of all sub-tasks and records the sub-tasks that happen."""

    SAVED = ("events", "oven_on", "_watchers")

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.events: list[Event] = []
        """Sub-tasks that happened, in order."""
        self.oven_on = False
        """Whether the oven is on."""
        self._watchers: dict[str, Watcher] = {
            row.name: WATCHERS[type(row.event)](row.event, self._model) for row in ROWS
        }

    @property
    def bag_in_cup(self) -> bool:
        """Whether the tea bag lies in the cup."""
        watchers = [w for w in self._watchers.values() if isinstance(w, DropWatcher)]
        return any(watcher.inside for watcher in watchers if watcher.thing == "tea_bag")

    @property
    def stirring(self) -> bool:
        """Whether the spoon moves in the liquid now."""
        return any(w.stirring for w in self._watchers.values() if isinstance(w, StirWatcher))

    def update(self, data: mujoco.MjData, liquids: Liquids) -> None:
        """Look at the station once."""
        for row in ROWS:
            if self._watchers[row.name].happened(data, liquids):
                self.events.append(Event(row.name, float(data.time)))
                self.oven_on = self.oven_on if row.oven is None else row.oven

    def state(self) -> dict[str, Any]:
        """Everything that changes, as copies by name."""
        watchers = {name: watcher.state() for name, watcher in self._watchers.items()}
        return {"events": list(self.events), "oven_on": self.oven_on, "watchers": watchers}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Return to what `state()` gave."""
        self.events, self.oven_on = list(state["events"]), state["oven_on"]
        for name, watcher in self._watchers.items():
            watcher.restore(state["watchers"][name])
