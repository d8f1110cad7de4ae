"""The mistakes a demonstrator can be told to make, in one registry.

A mistake is a function from a plan to the plan with the mistake in it. Mistakes compose: each takes
a plan that may hold others already, and leaves the steps of those alone.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from teasim.common.errors import ConfigError
from teasim.common.registry import named
from teasim.task.recipes import CRITICAL, POURED, PRECEDENCE, effective, recognisable
from teasim.task.subtasks import REGISTRY, ROWS, find_subtask

Manner = Literal["well", "ineffective", "abandoned"]
"""How a step is carried out."""
WELL: Manner = "well"
INEFFECTIVE: Manner = "ineffective"
"""All of the motion without the effect: beside the cup, not far enough, above the liquid."""
ABANDONED: Manner = "abandoned"
"""Given up half-way, with everything put back."""

MISSING_THE_CUP = tuple(row.name for row in ROWS if row.misses)
"""Sub-tasks that miss the cup when they are ineffective; the milk jug is not tilted enough."""


@dataclass(frozen=True)
class PlannedMistake:
    """A mistake before it has a time span."""

    name: str
    """Name in `MISTAKES`."""
    subtask: str
    """The sub-task done wrong; for a wrong object, the one that should have been done."""
    position: int
    """Index of the step at which it happens; a skipped sub-task was due before that step."""


@dataclass(frozen=True)
class Plan:
    """The steps of a demonstration and the mistakes planned in them."""

    steps: tuple[str, ...]
    """Sub-tasks in order."""
    mistakes: tuple[PlannedMistake, ...] = ()
    """Mistakes built into `steps`."""

    def manner(self, position: int) -> Manner:
        """Return how step number `position` is carried out."""
        for manner in (INEFFECTIVE, ABANDONED):
            if any(m.name == manner and m.position == position for m in self.mistakes):
                return manner
        return WELL

    @property
    def outcome(self) -> tuple[str, ...]:
        """Sub-tasks that physics recognises when the plan is carried out, in order."""
        return recognisable([self.steps[k] for k in self._tried()])

    @property
    def labels(self) -> tuple[PlannedMistake, ...]:
        """The planned mistakes, and steps that have no effect as a consequence of them.

        A vessel that a wrong object or a repetition emptied has nothing to pour at its own step:
        that step is carried out well and is ineffective all the same.
        """
        tried = self._tried()
        effects = effective([self.steps[k] for k in tried])
        known = {m.position for m in self.mistakes if m.name != "skip"}
        without = {k for k, effect in zip(tried, effects, strict=True) if not effect}
        # What a spoilt pouring emptied before has not been tried either.
        without |= {k for k in range(len(self.steps)) if k not in tried}
        implied = (PlannedMistake(INEFFECTIVE, self.steps[k], k) for k in sorted(without - known))
        return (*self.mistakes, *implied)

    @property
    def spilled(self) -> tuple[str, ...]:
        """Pourings whose content goes beside the cup."""
        return tuple(
            name
            for k, name in enumerate(self.steps)
            if self._misses(k) and name not in self.steps[:k]
        )

    def _tried(self) -> list[int]:
        """Positions of the steps that are carried out well with what they need at hand."""
        spilled = {name: k for k, name in reversed(list(enumerate(self.steps))) if self._misses(k)}
        return [
            k
            for k, name in enumerate(self.steps)
            if self.manner(k) == WELL and k < spilled.get(name, len(self.steps))
        ]

    def _misses(self, position: int) -> bool:
        return self.manner(position) == INEFFECTIVE and self.steps[position] in MISSING_THE_CUP

    def free(self, choices: tuple[str, ...]) -> list[int]:
        """Return the positions of steps among `choices` that hold no mistake yet."""
        taken = {m.position for m in self.mistakes if m.name != "skip"}
        return [k for k, name in enumerate(self.steps) if name in choices and k not in taken]


Mistake = Callable[[Plan, np.random.Generator, str | None], Plan]


def skip(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Leave out `subtask`, or by default a random one of the critical ones still in the plan.

    Raises:
        ConfigError: there is no such sub-task, or nothing is left to skip.
    """
    position = _choose("skip", plan, rng, subtask, Choices(CRITICAL, plan.steps))
    missing = plan.steps[position]
    steps = plan.steps[:position] + plan.steps[position + 1 :]
    shifted = _shifted(plan.mistakes, position, -1)
    return Plan(steps, (*shifted, PlannedMistake("skip", missing, position)))


def wrong_order(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Do `subtask`, by default a random one, right before a sub-task that it has to wait for.

    Raises:
        ConfigError: nothing in the plan has to wait for anything before it.
    """
    late = _choose("wrong_order", plan, rng, subtask, Choices(tuple(_broken(plan))))
    name = plan.steps[late]
    awaited = [k for k in plan.free(PRECEDENCE[name]) if k < late]
    early = awaited[rng.integers(len(awaited))]
    rest = plan.steps[:late] + plan.steps[late + 1 :]
    steps = (*rest[:early], name, *rest[early:])
    moved = _shifted(_shifted(plan.mistakes, late, -1), early, +1)
    return Plan(steps, (*moved, PlannedMistake("wrong_order", name, early)))


def repeat(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Do `subtask`, by default a random one, a second time, right after the first time or later.

    A vessel is empty the second time. The single tea bag cannot be added twice.

    Raises:
        ConfigError: the sub-task cannot be done twice, or is not in the plan.
    """
    again = tuple(name for name in plan.steps if not REGISTRY[name].once)
    first = _choose("repeat", plan, rng, subtask, Choices(again))
    second = int(rng.integers(first + 1, len(plan.steps) + 1))
    name = plan.steps[first]
    steps = (*plan.steps[:second], name, *plan.steps[second:])
    shifted = _shifted(plan.mistakes, second, +1)
    return Plan(steps, (*shifted, PlannedMistake("repeat", name, second)))


def wrong_object(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Pour from another vessel than `subtask`, by default a random pouring, asks for.

    Raises:
        ConfigError: the sub-task pours nothing, or is not in the plan.
    """
    position = _choose("wrong_object", plan, rng, subtask, Choices(POURED))
    meant = plan.steps[position]
    others = [name for name in POURED if name != meant]
    taken = others[rng.integers(len(others))]
    steps = (*plan.steps[:position], taken, *plan.steps[position + 1 :])
    return Plan(steps, (*plan.mistakes, PlannedMistake("wrong_object", meant, position)))


def ineffective(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Go through the motion of `subtask`, by default a random one, without its effect.

    Raises:
        ConfigError: the sub-task is not in the plan.
    """
    return _in_manner(INEFFECTIVE, plan, rng, subtask)


def abandoned(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Begin `subtask`, by default a random one, and put everything back half-way.

    Raises:
        ConfigError: the sub-task is not in the plan.
    """
    return _in_manner(ABANDONED, plan, rng, subtask)


MISTAKES: Mapping[str, Mistake] = MappingProxyType(
    {
        "skip": skip,
        "wrong_order": wrong_order,
        "repeat": repeat,
        "ineffective": ineffective,
        "wrong_object": wrong_object,
        "abandoned": abandoned,
    }
)
"""Every mistake by name: a function of a plan, a generator and perhaps a sub-task."""


def mistake(name: str) -> Mistake:
    """Return the mistake of this name.

    Raises:
        ConfigError: there is none.
    """
    return named("mistake", MISTAKES, name)


def spoil(plan: Plan, spec: str, rng: np.random.Generator) -> Plan:
    """Add the mistakes of a specification NAME[@SUBTASK][+NAME[@SUBTASK]...] to a plan.

    Raises:
        ConfigError: a name is unknown, or a mistake does not fit into the plan.
    """
    for part in spec.split("+"):
        name, at, subtask = part.partition("@")
        plan = mistake(name)(plan, rng, subtask if at else None)
    return plan


@dataclass(frozen=True)
class Choices:
    """Sub-tasks at which a mistake can be made."""

    at_random: tuple[str, ...]
    """Those among which one is drawn."""
    by_name: tuple[str, ...] | None = None
    """Those that can be asked for; None if they are the same."""


def _choose(
    kind: str,
    plan: Plan,
    rng: np.random.Generator,
    subtask: str | None,
    choices: Choices,
) -> int:
    """Return the position of `subtask`, or of a random choice, among the steps without mistake."""
    if subtask is not None:
        wanted = dict.fromkeys(choices.at_random if choices.by_name is None else choices.by_name)
        possible = [name for name in wanted if plan.free((name,))]
        if find_subtask(subtask).name not in possible:
            raise ConfigError(
                f"The mistake '{kind}' cannot be made at '{subtask}' in this plan; "
                f"choose {', '.join(possible) or 'another mistake'}."
            )
        return plan.free((subtask,))[0]
    positions = plan.free(choices.at_random)
    if not positions:
        raise ConfigError(
            f"The mistake '{kind}' finds no step left to change in a plan of "
            f"{', '.join(plan.steps) or 'no steps'}; ask for fewer mistakes in one demonstration."
        )
    return positions[rng.integers(len(positions))]


def _broken(plan: Plan) -> list[str]:
    """Return the sub-tasks that wait for a step before them which holds no mistake."""
    return [
        plan.steps[k]
        for k in plan.free(plan.steps)
        if any(before < k for before in plan.free(PRECEDENCE[plan.steps[k]]))
    ]


def _in_manner(manner: Manner, plan: Plan, rng: np.random.Generator, subtask: str | None) -> Plan:
    # A step that would have no effect anyway does not show the mistake.
    telling = tuple(dict.fromkeys(plan.outcome))
    position = _choose(manner, plan, rng, subtask, Choices(telling, plan.steps))
    made = PlannedMistake(manner, plan.steps[position], position)
    return Plan(plan.steps, (*plan.mistakes, made))


def _shifted(
    mistakes: tuple[PlannedMistake, ...], position: int, by: int
) -> tuple[PlannedMistake, ...]:
    """Return the mistakes after a step was removed (-1) or inserted (+1) at `position`."""
    return tuple(
        replace(m, position=m.position + by * (m.position >= position + (by < 0))) for m in mistakes
    )
