"""The mistakes a demonstrator can be told to make, in one registry."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from teasim.errors import ConfigError
from teasim.task.recipes import CRITICAL, check_subtask


@dataclass(frozen=True)
class Plan:
    """What a demonstrator is to do, and what it is told to do wrong."""

    steps: tuple[str, ...]
    """Sub-tasks in order."""
    mistakes: tuple["PlannedMistake", ...] = ()
    """Mistakes built into `steps`."""


@dataclass(frozen=True)
class PlannedMistake:
    """A mistake before it has a time span."""

    name: str
    """Name in `MISTAKES`."""
    subtask: str
    """The sub-task done wrong."""
    position: int
    """Index into the plan's steps at which it happens; what is skipped was due before it."""


Mistake = Callable[[Plan, np.random.Generator, str | None], Plan]


def skip(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Leave out `subtask`, or else one of the critical three that is still in the plan.

    Raises:
        ConfigError: there is no such sub-task, or nothing is left to skip.
    """
    if subtask is not None:
        if check_subtask(subtask) not in plan.steps:
            raise ConfigError(f"'{subtask}' cannot be skipped in a plan that does not hold it.")
        return without(plan, subtask)
    choices = [name for name in CRITICAL if name in plan.steps]
    if not choices:
        raise ConfigError(
            f"Nothing is left to skip in a plan without {', '.join(CRITICAL)}; "
            "ask for at most three skips in one demonstration."
        )
    return without(plan, choices[rng.integers(len(choices))])


def without(plan: Plan, subtask: str) -> Plan:
    """The plan with `subtask` left out, the omission written down."""
    position = plan.steps.index(subtask)
    shifted = tuple(
        PlannedMistake(m.name, m.subtask, m.position - (m.position > position))
        for m in plan.mistakes
    )
    steps = plan.steps[:position] + plan.steps[position + 1 :]
    return Plan(steps, (*shifted, PlannedMistake("skip", subtask, position)))


MISTAKES: Mapping[str, Mistake] = MappingProxyType({"skip": skip})
"""Every mistake by name: a function from a plan, randomness and perhaps a sub-task to a plan."""


def mistake(name: str) -> Mistake:
    """Look a mistake up.

    Raises:
        ConfigError: there is none of that name.
    """
    if name not in MISTAKES:
        raise ConfigError(f"Unknown mistake '{name}'; choose {', '.join(MISTAKES)}.")
    return MISTAKES[name]
