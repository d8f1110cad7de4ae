"""Records collisions, speeds and contact depths that a real robot must not exceed."""

from collections.abc import Sequence

import mujoco
import numpy as np

from teasim.constants import ARMS
from teasim.world.bodies.embodiments import EMBODIMENTS
from teasim.world.simulation import Simulation

TCP_SPEED_LIMIT = 1.5
"""Largest speed of the tool centre point [m/s] (ABB controller configuration)."""
PENETRATION_LIMIT = 0.003
"""Largest admissible depth of a contact [m]; deeper ones mean that one object entered another."""
KEEP_OFF = ("torso", "table", "hob", "cup")
"""Roles that an arm, without its fingers, must not touch; the other arm is forbidden as well."""

Pair = tuple[str, str]


def roles(model: mujoco.MjModel) -> tuple[str, ...]:
    """Return what each shape belongs to (ngeom,): an arm, its fingers, the torso, or an object."""
    return tuple(_role(model, geom) for geom in range(model.ngeom))


def _role(model: mujoco.MjModel, geom: int) -> str:
    body, name = model.body(model.geom_bodyid[geom]).name, model.geom(geom).name
    side = body.partition("_")[0]
    if side in ARMS:
        return f"{side}_fingers" if "finger" in body else f"{side}_arm"
    if side in EMBODIMENTS:
        limb = name.removeprefix(f"{side}_").partition("_")[0]
        return f"{limb}_arm" if limb in ARMS else "torso"
    return str(name if body == "world" else body.partition("/")[0])


class Monitor:
    """Observes a simulation after every update and keeps the extremes."""

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        model = simulation.model
        self._roles = roles(model)
        joints = [name for arm in ARMS for name in simulation.embodiment.joints[arm]]
        self._speeds = np.array([model.joint(name).dofadr[0] for name in joints])
        self._tools = np.array([model.site(f"{arm}_tcp").id for arm in ARMS])
        self._limits = np.tile(simulation.embodiment.speeds, len(ARMS))
        self._before = (np.inf, np.zeros((len(ARMS), 3)))
        self.touches: dict[Pair, float] = {}
        """Deepest penetration of each pair of roles that touched [m]; the names are sorted."""
        self.joint_speed = 0.0
        """Largest joint speed as a share of that joint's limit."""
        self.tcp_speed = 0.0
        """Largest speed of a tool centre point [m/s]."""
        simulation.observers.append(self._look)

    @property
    def penetration(self) -> float:
        """Deepest penetration of any contact [m]."""
        return max(self.touches.values(), default=0.0)

    @property
    def forbidden(self) -> tuple[Pair, ...]:
        """Pairs of roles that touched and must not."""
        return tuple(pair for pair in sorted(self.touches) if is_forbidden(pair))

    def _look(self) -> None:
        data = self._simulation.data
        for pair, distance in zip(data.contact.geom, data.contact.dist, strict=True):
            if distance < 0:
                first, second = sorted(self._roles[geom] for geom in pair)
                deepest = max(self.touches.get((first, second), 0.0), -float(distance))
                self.touches[first, second] = deepest
        share = np.abs(data.qvel[self._speeds]) / self._limits
        self.joint_speed = max(self.joint_speed, float(share.max()))
        self._look_at_tools(float(data.time), data.site_xpos[self._tools].copy())

    def _look_at_tools(self, time: float, tools: np.ndarray) -> None:
        earlier, places = self._before
        self._before = (time, tools)
        if time > earlier:  # else the station was reset in between
            speed = np.linalg.norm(tools - places, axis=1).max() / (time - earlier)
            self.tcp_speed = max(self.tcp_speed, float(speed))


def is_forbidden(pair: Sequence[str]) -> bool:
    """Whether contact between these two roles is forbidden."""
    arms = [role for role in pair if role.endswith("_arm")]
    sides = {role.partition("_")[0] for role in pair if role.endswith(("_arm", "_fingers"))}
    return len(sides) > 1 or bool(arms and set(pair) & set(KEEP_OFF))
