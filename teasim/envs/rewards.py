"""The reward of the joint-level environment: a weighted sum of named terms."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from typing import Any, Self

from teasim.common.errors import ConfigError
from teasim.constants import CONTROL_TIMESTEP, SUBTASKS
from teasim.envs.registration import MAX_SECONDS
from teasim.task.scoring import Verdict
from teasim.task.subtasks import REGISTRY
from teasim.world.collisions import CollisionCounter
from teasim.world.simulation import Simulation
from teasim.world.state import Saved

OVEN_SECONDS = 60.0
"""Time for which the oven may be on [s]; the optimal order needs it for about 40 s."""


class Weights:
    """Weights of the named terms of a reward; subclasses are frozen dataclasses."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a weight that is no finite number."""
        for name, weight in vars(self).items():
            number = isinstance(weight, Real) and not isinstance(weight, bool)
            if not number or not math.isfinite(weight):
                raise ConfigError(f"The reward weight of '{name}' is {weight}; give a number.")

    @classmethod
    def of(cls, given: Mapping[str, float] | None) -> Self:
        """Return the default weights, replaced by those `given`.

        Raises:
            ConfigError: there is no term of that name, or a weight is not a finite number.
        """
        names = list(cls.__annotations__)
        for name in given or {}:
            if name not in names:
                raise ConfigError(f"Unknown reward term '{name}'; choose {', '.join(names)}.")
        return cls(**(given or {}))

    def total(self, terms: Mapping[str, float]) -> float:
        """Return the reward, the weighted sum of the terms."""
        return float(sum(getattr(self, name) * term for name, term in terms.items()))


@dataclass(frozen=True)
class RewardWeights(Weights):
    """Weights of the terms of the reward, see `RewardTerms`."""

    subtasks: float = 1.0
    """Weight of the share of sub-tasks that were completed for the first time."""
    success: float = 1.0
    """Weight of reaching the goal."""
    spill: float = 0.001
    """Weight of 1 ml or 1 g on the table."""
    collision: float = 0.01
    """Weight of a forbidden contact that begins."""
    unsafe: float = 0.1
    """Weight of an episode of full length with the oven on for too long."""


class RewardTerms(Saved):
    """The terms of the reward since they were taken last; penalties are negative.

    * `subtasks`: share of the sub-tasks that were completed for the first time; at most 1 in total.
    * `success`: 1 when the goal is reached.
    * `spill`: minus the amount that was spilled [ml or g]; at least -175 in total.
    * `collision`: minus the number of forbidden contacts that began.
    * `unsafe`: minus the time for which the oven was on beyond `OVEN_SECONDS`, as a share of the
      longest episode; above -1 in total.
    """

    SAVED = ("_counted", "_spilled")

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        self._collisions = CollisionCounter(simulation)
        self.reset()

    def reset(self) -> None:
        """Start a new episode, after the station has come to rest."""
        self._collisions.reset()
        self._counted = 0
        self._spilled = sum(self._simulation.liquids.spilled.values())

    def state(self) -> dict[str, Any]:
        """Return everything that changes, with the contacts."""
        return super().state() | {"collisions": self._collisions.state()}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Return to what `state()` gave."""
        super().restore(state)
        self._collisions.restore(state["collisions"])

    def take(self, verdict: Verdict) -> dict[str, float]:
        """Return the terms since the last call, given the present verdict."""
        counted, spilled = self._counted, self._spilled
        self._counted = len(set(self._simulation.subtasks_done))
        self._spilled = sum(self._simulation.liquids.spilled.values())
        collisions, self._collisions.begun = self._collisions.begun, 0
        return {
            "subtasks": (self._counted - counted) / len(SUBTASKS),
            "success": float(verdict.success),
            "spill": float(spilled - self._spilled),
            "collision": float(-collisions),
            "unsafe": (0.0 - self._overtime()) / MAX_SECONDS,
        }

    def _overtime(self) -> float:
        """Return the part of the last control step in which the oven was on for too long [s]."""
        if not self._simulation.oven_on:
            return 0.0
        events = self._simulation.events
        begun = max(event.time for event in events if REGISTRY[event.subtask].oven)
        beyond = float(self._simulation.data.time) - begun - OVEN_SECONDS
        return min(max(beyond, 0.0), CONTROL_TIMESTEP)
