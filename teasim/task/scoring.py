"""When tea has been made, and what went wrong on the way."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from teasim.constants import SUBTASKS
from teasim.task.recipes import PRECEDENCE

SPILL_TOLERANCE = 5.0
"""Less than this on the table does not count as spilled [ml or g]."""


@dataclass(frozen=True)
class Verdict:
    """What the physics says about an episode so far."""

    success: bool
    """Oven was on and is off; bag, sugar, milk and water are in; stirred last."""
    violations: tuple[str, ...]
    """What was done against the precedence, and what was spilled."""
    unsafe: bool
    """The oven is on."""


def judge(done: Sequence[str], *, oven_on: bool, spilled: Mapping[str, float]) -> Verdict:
    """Judge an episode by its physical events.

    Args:
        done: sub-tasks that happened, in order.
        oven_on: whether the oven is on now.
        spilled: amount on the table by content [ml or g].
    """
    complete = all(name in done for name in SUBTASKS)
    success = complete and not oven_on and done[-1] == "stir"
    return Verdict(success, (*broken_precedence(done), *spills(spilled)), oven_on)


def broken_precedence(done: Sequence[str]) -> tuple[str, ...]:
    """One word per sub-task that came before something it has to wait for."""
    return tuple(
        f"{name}_before_{before}"
        for k, name in enumerate(done)
        for before in PRECEDENCE[name]
        if before not in done[:k]
    )


def spills(spilled: Mapping[str, float]) -> tuple[str, ...]:
    """One word per content of which more than the tolerance is on the table."""
    return tuple(f"spilled_{name}" for name, amount in spilled.items() if amount > SPILL_TOLERANCE)
