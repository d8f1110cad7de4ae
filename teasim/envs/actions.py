"""Meanings of the actions of the joint-level environment, and their check."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import mujoco
import numpy as np

from teasim.common.errors import ConfigError
from teasim.common.registry import named
from teasim.constants import ARMS, CONTROL_TIMESTEP
from teasim.world.bodies.embodiments import Embodiment

DELTA_SHARE = 0.85
"""Share of a joint's largest speed that a full `delta` action asks for; skills use no more."""


@dataclass(frozen=True)
class Control:
    """Conversion of an action in [-1, 1] to joint angles [rad] and openings [m].

    All arrays have one number per name in `Embodiment.state_names`: (16,) for YuMi.
    """

    origin: np.ndarray
    """Target of the action 0; nan where it is the last target."""
    reach: np.ndarray
    """Distance from there to the target of the action 1."""
    low: np.ndarray
    """Smallest angles and openings."""
    high: np.ndarray
    """Largest angles and openings."""

    def target(self, action: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return the target of an action, given the last target; both are clipped."""
        action = np.minimum(np.maximum(action, -1.0), 1.0)
        target = self._zero(last) + self.reach * action
        return np.asarray(np.minimum(np.maximum(target, self.low), self.high))

    def action(self, target: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return the action for a target, given the last one; outside [-1, 1] if it is too far."""
        return np.asarray((target - self._zero(last)) / self.reach)

    def _zero(self, last: np.ndarray) -> np.ndarray:
        return np.where(np.isnan(self.origin), last, self.origin)


def position_control(body: Embodiment, model: mujoco.MjModel) -> Control:
    """Return the control whose actions span the ranges of the joints and of the grippers."""
    ranges = [model.joint(name).range for arm in ARMS for name in body.joints[arm]]
    limits = np.array([*ranges, *[body.openings] * len(ARMS)])
    return Control(limits.mean(axis=1), np.ptp(limits, axis=1) / 2, *limits.T.copy())


def delta_control(body: Embodiment, model: mujoco.MjModel) -> Control:
    """Return the control whose actions change the last target of every joint.

    The grippers are as in `position_control`.
    """
    control = position_control(body, model)
    origin, reach = control.origin.copy(), control.reach.copy()
    joints = body.width * len(ARMS)
    origin[:joints] = np.nan
    reach[:joints] = DELTA_SHARE * CONTROL_TIMESTEP * np.tile(body.speeds, len(ARMS))
    return replace(control, origin=origin, reach=reach)


CONTROLS: Mapping[str, Callable[[Embodiment, mujoco.MjModel], Control]] = MappingProxyType(
    {"position": position_control, "delta": delta_control}
)
"""All meanings of actions by name."""


def make_control(name: str, body: Embodiment, model: mujoco.MjModel) -> Control:
    """Return the meaning of actions with this name, for a body and its model.

    Raises:
        ConfigError: there is none.
    """
    return named("control", CONTROLS, name)(body, model)


def check_action(action: object, names: Sequence[str]) -> np.ndarray:
    """Return an action as one float64 number per name; the numbers may exceed [-1, 1].

    Raises:
        ConfigError: the number of numbers is wrong, or one of them is not finite.
    """
    try:
        numbers = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError):
        raise ConfigError(f"An action is {len(names)} numbers, not {action!r}.") from None
    if numbers.shape != (len(names),):
        raise ConfigError(f"An action has the shape ({len(names)},), not {numbers.shape}.")
    if not np.isfinite(numbers).all():
        which = int(np.argmin(np.isfinite(numbers)))
        raise ConfigError(
            f"The action for {names[which]} is {numbers[which]}; give a finite number."
        )
    return numbers
