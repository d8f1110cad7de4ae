"""What has to be kept so that a running station can be continued from where it was."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import mujoco
import numpy as np

from teasim.common.errors import ConfigError

_KEPT = mujoco.mjtState.mjSTATE_INTEGRATION
# Pictures and skills see the poses of the last physics step's beginning, not those of its end.
_POSES = (
    *("xpos", "xquat", "xmat", "xipos", "ximat", "geom_xpos", "geom_xmat", "site_xpos"),
    *("site_xmat", "cam_xpos", "cam_xmat", "light_xpos", "light_xdir"),
)


class Saved:
    """A part of the world that can be put back to an earlier state."""

    SAVED: ClassVar[tuple[str, ...]] = ()
    """Attributes that change while the world runs."""

    def state(self) -> dict[str, Any]:
        """Everything that changes, as copies by name."""
        return {name: copy.deepcopy(getattr(self, name)) for name in self.SAVED}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Go back to what `state()` gave."""
        for name in self.SAVED:
            setattr(self, name, copy.deepcopy(state[name]))


@dataclass(frozen=True)
class PhysicsState:
    """MuJoCo's part of a state."""

    integration: np.ndarray
    """MuJoCo's `mjSTATE_INTEGRATION`: time, positions, velocities, commands, warm start (n,)."""
    bodies: np.ndarray
    """Place [m] and orientation (wxyz) of all bodies in their parents (nbody, 7): the layout."""
    poses: Mapping[str, np.ndarray]
    """What MuJoCo last derived of where things are, by its name in `MjData`."""

    @classmethod
    def of(cls, model: mujoco.MjModel, data: mujoco.MjData) -> "PhysicsState":
        """Copy the present state."""
        integration = np.empty(mujoco.mj_stateSize(model, _KEPT))
        mujoco.mj_getState(model, data, integration, _KEPT)
        bodies = np.hstack([model.body_pos, model.body_quat])
        return cls(integration, bodies, {name: getattr(data, name).copy() for name in _POSES})

    def restore(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Write the state back.

        Raises:
            ConfigError: it was taken from another model.
        """
        size = mujoco.mj_stateSize(model, _KEPT)
        if self.integration.shape != (size,) or self.bodies.shape != (model.nbody, 7):
            raise ConfigError(
                f"The state is of another station ({self.integration.size} numbers, "
                f"{len(self.bodies)} bodies; this one has {size} and {model.nbody})."
            )
        model.body_pos[:], model.body_quat[:] = self.bodies[:, :3], self.bodies[:, 3:]
        mujoco.mj_setState(model, data, self.integration, _KEPT)
        mujoco.mj_forward(model, data)  # finds the contacts, and spoils the warm start
        mujoco.mj_setState(model, data, self.integration, _KEPT)
        for name, poses in self.poses.items():
            getattr(data, name)[:] = poses


@dataclass(frozen=True)
class SimulationState:
    """A running station between two control steps; it can be pickled."""

    physics: PhysicsState
    """MuJoCo's part."""
    target: np.ndarray
    """Last target of the control: joint angles [rad], openings [m] (16,)."""
    controller: Mapping[str, Any]
    """State of the motor control."""
    liquids: Mapping[str, Any]
    """Levels, spills and streams."""
    recogniser: Mapping[str, Any]
    """What happened so far."""
