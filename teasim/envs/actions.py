"""What an action of the joint-level environment means, and how it is checked."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import mujoco
import numpy as np

from teasim.common.errors import ConfigError
from teasim.common.registry import named
from teasim.constants import (
    ARM_JOINTS,
    ARMS,
    CONTROL_TIMESTEP,
    GRIPPER_OPEN,
    GRIPPER_SQUEEZE,
    STATE_NAMES,
)
from teasim.world.yumi import JOINT_SPEEDS

DELTA_SHARE = 0.85
"""Share of a joint's largest speed that a full `delta` action asks for; skills use no more."""


@dataclass(frozen=True)
class Control:
    """How an action, 16 numbers in [-1, 1], becomes joint angles [rad] and openings [m]."""

    origin: np.ndarray
    """What the action 0 means (16,); nan where it means the last target."""
    reach: np.ndarray
    """How far from there the action 1 is (16,)."""
    low: np.ndarray
    """Smallest angles and openings (16,)."""
    high: np.ndarray
    """Largest angles and openings (16,)."""

    def target(self, action: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Target (16,) of an action (16,), given the last one; what is out of range is clipped."""
        action = np.minimum(np.maximum(action, -1.0), 1.0)
        target = self._zero(last) + self.reach * action
        return np.asarray(np.minimum(np.maximum(target, self.low), self.high))

    def action(self, target: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Action (16,) of a target (16,), given the last one; out of [-1, 1] if it is too far."""
        return np.asarray((target - self._zero(last)) / self.reach)

    def _zero(self, last: np.ndarray) -> np.ndarray:
        return np.where(np.isnan(self.origin), last, self.origin)


def position_control(model: mujoco.MjModel) -> Control:
    """Actions span the ranges of the joints and of the grippers."""
    ranges = [model.joint(name).range for arm in ARMS for name in ARM_JOINTS[arm]]
    limits = np.array([*ranges, *[(GRIPPER_SQUEEZE, GRIPPER_OPEN)] * len(ARMS)])
    return Control(limits.mean(axis=1), np.ptp(limits, axis=1) / 2, *limits.T.copy())


def delta_control(model: mujoco.MjModel) -> Control:
    """Actions change the last target of every joint; the grippers are as in `position_control`."""
    control = position_control(model)
    origin, reach = control.origin.copy(), control.reach.copy()
    origin[:14] = np.nan
    reach[:14] = DELTA_SHARE * CONTROL_TIMESTEP * np.tile(JOINT_SPEEDS, len(ARMS))
    return replace(control, origin=origin, reach=reach)


CONTROLS: Mapping[str, Callable[[mujoco.MjModel], Control]] = MappingProxyType(
    {"position": position_control, "delta": delta_control}
)
"""Every meaning of an action by name."""


def make_control(name: str, model: mujoco.MjModel) -> Control:
    """Look a meaning of actions up and make it for a model.

    Raises:
        ConfigError: there is none of that name.
    """
    return named("control", CONTROLS, name)(model)


def check_action(action: object) -> np.ndarray:
    """Return an action as 16 numbers (16,) float64; they may be beyond [-1, 1].

    Raises:
        ConfigError: they are not 16, or one of them is not finite.
    """
    try:
        numbers = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise ConfigError(f"An action is {len(STATE_NAMES)} numbers, not {action!r}.") from None
    if numbers.shape != (len(STATE_NAMES),):
        raise ConfigError(f"An action has the shape ({len(STATE_NAMES)},), not {numbers.shape}.")
    if not np.isfinite(numbers).all():
        which = int(np.argmin(np.isfinite(numbers)))
        raise ConfigError(
            f"The action for {STATE_NAMES[which]} is {numbers[which]}; give a finite number."
        )
    return numbers
