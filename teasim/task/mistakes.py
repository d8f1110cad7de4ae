"""The mistakes a demonstrator can be told to make, in one registry.

A mistake is a function from a plan to the plan with the mistake in it. Mistakes compose: each takes
a plan that may hold others already, and leaves the steps those are about alone.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from teasim.common.errors import ConfigError
from teasim.common.registry import named
from teasim.task.recipes import CRITICAL, POURED, PRECEDENCE, check_subtask, recognisable

Manner = Literal["well", "ineffective", "abandoned"]
"""How a step is carried out."""
WELL: Manner = "well"
INEFFECTIVE: Manner = "ineffective"
"""All the motion and no effect: beside the cup, not far enough, above the liquid."""
ABANDONED: Manner = "abandoned"
"""Begun, given up half-way, everything put back."""


MISSING_THE_CUP = ("add_water", "add_sugar")
"""Pourings that are ineffective because they miss; the milk jug is not tilted enough."""


@dataclass(frozen=True)
class PlannedMistake:
    """A mistake before it has a time span."""

    name: str
    """Name in `MISTAKES`."""
    subtask: str
    """The sub-task done wrong; for a wrong object, the one that should have been done."""
    position: int
    """Index into the plan's steps at which it happens; what is skipped was due before it."""


@dataclass(frozen=True)
class Plan:
    """What a demonstrator is to do, and what it is told to do wrong."""

    steps: tuple[str, ...]
    """Sub-tasks in order."""
    mistakes: tuple[PlannedMistake, ...] = ()
    """Mistakes built into `steps`."""

    def manner(self, position: int) -> Manner:
        """How step number `position` is carried out."""
        for manner in (INEFFECTIVE, ABANDONED):
            if any(m.name == manner and m.position == position for m in self.mistakes):
                return manner
        return WELL

    @property
    def outcome(self) -> tuple[str, ...]:
        """Sub-tasks that physics will recognise when the plan is carried out, in order."""
        spilled = {name: k for k, name in reversed(list(enumerate(self.steps))) if self._misses(k)}
        effective = [
            name
            for k, name in enumerate(self.steps)
            if self.manner(k) == WELL and k < spilled.get(name, len(self.steps))
        ]
        return recognisable(effective)

    @property
    def spilled(self) -> tuple[str, ...]:
        """Pourings of which the content goes beside the cup."""
        return tuple(
            name
            for k, name in enumerate(self.steps)
            if self._misses(k) and name not in self.steps[:k]
        )

    def _misses(self, position: int) -> bool:
        return self.manner(position) == INEFFECTIVE and self.steps[position] in MISSING_THE_CUP

    def free(self, choices: tuple[str, ...]) -> list[int]:
        """Positions of steps among `choices` that no mistake is about yet."""
        taken = {m.position for m in self.mistakes if m.name != "skip"}
        return [k for k, name in enumerate(self.steps) if name in choices and k not in taken]


Mistake = Callable[[Plan, np.random.Generator, str | None], Plan]


def skip(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Leave out `subtask`, or else one of the critical three that is still in the plan.

    Raises:
        ConfigError: there is no such sub-task, or nothing is left to skip.
    """
    position = _choose("skip", plan, rng, subtask, CRITICAL, by_name=plan.steps)
    missing = plan.steps[position]
    steps = plan.steps[:position] + plan.steps[position + 1 :]
    shifted = _shifted(plan.mistakes, position, -1)
    return Plan(steps, (*shifted, PlannedMistake("skip", missing, position)))


def wrong_order(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Do `subtask`, or any, just before something that it has to wait for.

    Raises:
        ConfigError: nothing in the plan has to wait for anything before it.
    """
    late = _choose("wrong_order", plan, rng, subtask, tuple(_broken(plan)))
    name = plan.steps[late]
    awaited = [k for k in plan.free(PRECEDENCE[name]) if k < late]
    early = awaited[rng.integers(len(awaited))]
    rest = plan.steps[:late] + plan.steps[late + 1 :]
    steps = (*rest[:early], name, *rest[early:])
    moved = _shifted(_shifted(plan.mistakes, late, -1), early, +1)
    return Plan(steps, (*moved, PlannedMistake("wrong_order", name, early)))


def repeat(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Do `subtask`, or any but the tea bag, a second time right after or later.

    There is one tea bag, so that it cannot be added twice; a vessel is empty the second time.

    Raises:
        ConfigError: the sub-task is the tea bag, or not in the plan.
    """
    again = tuple(name for name in plan.steps if name != "add_tea_bag")
    first = _choose("repeat", plan, rng, subtask, again)
    second = int(rng.integers(first + 1, len(plan.steps) + 1))
    name = plan.steps[first]
    steps = (*plan.steps[:second], name, *plan.steps[second:])
    shifted = _shifted(plan.mistakes, second, +1)
    return Plan(steps, (*shifted, PlannedMistake("repeat", name, second)))


def wrong_object(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Pour from another vessel than the one `subtask`, or any pouring, asks for.

    Raises:
        ConfigError: the sub-task pours nothing, or is not in the plan.
    """
    position = _choose("wrong_object", plan, rng, subtask, POURED)
    meant = plan.steps[position]
    others = [name for name in POURED if name != meant]
    taken = others[rng.integers(len(others))]
    steps = (*plan.steps[:position], taken, *plan.steps[position + 1 :])
    return Plan(steps, (*plan.mistakes, PlannedMistake("wrong_object", meant, position)))


def ineffective(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Go through all the motion of `subtask`, or any, without its effect.

    Raises:
        ConfigError: the sub-task is not in the plan.
    """
    return _in_manner(INEFFECTIVE, plan, rng, subtask)


def abandoned(plan: Plan, rng: np.random.Generator, subtask: str | None = None) -> Plan:
    """Begin `subtask`, or any, and put everything back half-way.

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
"""Every mistake by name: a function from a plan, randomness and perhaps a sub-task to a plan."""


def mistake(name: str) -> Mistake:
    """Look a mistake up.

    Raises:
        ConfigError: there is none of that name.
    """
    return named("mistake", MISTAKES, name)


def spoil(plan: Plan, spec: str, rng: np.random.Generator) -> Plan:
    """Put the mistakes of a specification NAME[@SUBTASK][+NAME[@SUBTASK]...] into a plan.

    Raises:
        ConfigError: a name is unknown, or a mistake does not fit into the plan.
    """
    for part in spec.split("+"):
        name, at, subtask = part.partition("@")
        plan = mistake(name)(plan, rng, subtask if at else None)
    return plan


def _choose(
    kind: str,
    plan: Plan,
    rng: np.random.Generator,
    subtask: str | None,
    choices: tuple[str, ...],
    by_name: tuple[str, ...] | None = None,
) -> int:
    """Position of `subtask`, or of a random one of `choices`, among the steps still free.

    `by_name` are the sub-tasks that can be asked for, where they are more than the `choices`.
    """
    if subtask is not None:
        wanted = dict.fromkeys(choices if by_name is None else by_name)
        possible = [name for name in wanted if plan.free((name,))]
        if check_subtask(subtask) not in possible:
            raise ConfigError(
                f"The mistake '{kind}' cannot be made at '{subtask}' in this plan; "
                f"choose {', '.join(possible) or 'another mistake'}."
            )
        return plan.free((subtask,))[0]
    positions = plan.free(choices)
    if not positions:
        raise ConfigError(
            f"The mistake '{kind}' finds nothing left to spoil in a plan of "
            f"{', '.join(plan.steps) or 'no steps'}; ask for fewer mistakes in one demonstration."
        )
    return positions[rng.integers(len(positions))]


def _broken(plan: Plan) -> list[str]:
    """Sub-tasks that wait for something which stands free before them in the plan."""
    return [
        plan.steps[k]
        for k in plan.free(plan.steps)
        if any(before < k for before in plan.free(PRECEDENCE[plan.steps[k]]))
    ]


def _in_manner(manner: Manner, plan: Plan, rng: np.random.Generator, subtask: str | None) -> Plan:
    # What would have no effect anyway (turning off what is off) shows nothing of the mistake.
    telling = tuple(dict.fromkeys(plan.outcome))
    position = _choose(manner, plan, rng, subtask, telling, by_name=plan.steps)
    made = PlannedMistake(manner, plan.steps[position], position)
    return Plan(plan.steps, (*plan.mistakes, made))


def _shifted(
    mistakes: tuple[PlannedMistake, ...], position: int, by: int
) -> tuple[PlannedMistake, ...]:
    """The mistakes after a step was taken out at (-1) or put in at (+1) `position`."""
    return tuple(
        PlannedMistake(m.name, m.subtask, m.position + by * (m.position >= position + (by < 0)))
        for m in mistakes
    )
