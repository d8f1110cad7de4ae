"""Saved states of a running station, from which it continues with the same bits."""

import copy
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import mujoco
import numpy as np

from teasim.common.errors import ConfigError

_KEPT = mujoco.mjtState.mjSTATE_INTEGRATION
# Pictures and skills read the poses at the beginning of the last physics step, not at its end.
_POSES = (
    *("xpos", "xquat", "xmat", "xipos", "ximat", "geom_xpos", "geom_xmat", "site_xpos"),
    *("site_xmat", "cam_xpos", "cam_xmat", "light_xpos", "light_xdir"),
)


class Saved:
    """A part of the station whose state can be saved and restored."""

    SAVED: ClassVar[tuple[str, ...]] = ()
    """Names of the attributes that change while the station runs."""

    def state(self) -> dict[str, Any]:
        """Return copies of the attributes in `SAVED` by name."""
        return {name: copy.deepcopy(getattr(self, name)) for name in self.SAVED}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restore what `state()` returned."""
        for name in self.SAVED:
            setattr(self, name, copy.deepcopy(state[name]))


@dataclass(frozen=True)
class PhysicsState:
    """State of the physics."""

    integration: np.ndarray
    """MuJoCo's `mjSTATE_INTEGRATION` (n,): time, positions, velocities, commands, warm start."""
    bodies: np.ndarray
    """Pose of each body in its parent (nbody, 7) [m, wxyz]; it holds the layout."""
    poses: Mapping[str, np.ndarray]
    """Poses that MuJoCo derived last, by their name in `MjData`."""

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
    """State of a station between two control steps; it can be pickled."""

    physics: PhysicsState
    """State of the physics."""
    target: np.ndarray
    """Last target: joint angles [rad] and openings [m] (2 n + 2,)."""
    controller: Mapping[str, Any]
    """State of the motor control."""
    liquids: Mapping[str, Any]
    """State of `Liquids`: amounts, spills and streams."""
    recogniser: Mapping[str, Any]
    """State of the event recogniser."""
