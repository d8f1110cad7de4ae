"""The orders in which tea is made: the paper's sequences and the precedence behind them."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from teasim.task.subtasks import REGISTRY, ROWS, Poured, Stirred, Subtask, find_subtask

SEQ_1 = tuple(row.name for row in sorted(ROWS, key=lambda row: row.seq_1))
"""The optimal order (the paper, section 4)."""

SEQ_2 = tuple(row.name for row in sorted(ROWS, key=lambda row: row.seq_2))
"""The sub-optimal order: the tea bag goes in late."""

LAST = SEQ_1[-1]
"""The sub-task that must come last; done too early, it has to be done again."""

CRITICAL = tuple(name for name in SEQ_1 if REGISTRY[name].critical)
"""Seq_3 leaves out one or two of these."""

POURED = tuple(row.name for row in ROWS if row.content is not None)
"""Sub-tasks that empty a vessel into the cup."""

OPTIONAL = tuple(row.name for row in ROWS if row.optional)
"""Sub-tasks that a pool may declare optional."""

PRECEDENCE = MappingProxyType({row.name: row.waits_for for row in ROWS})
"""What must have happened before each sub-task in a correct demonstration."""

OPTIMAL, SUBOPTIMAL, INCORRECT, LEGAL = "seq_1", "seq_2", "seq_3", "legal"
SEQUENCES = (OPTIMAL, SUBOPTIMAL, INCORRECT, LEGAL)
"""Labels of demonstrations; `legal` is a random order that respects the precedence."""


def is_legal(order: Sequence[str]) -> bool:
    """Whether `order` holds every sub-task once and respects the precedence."""
    if sorted(order) != sorted(REGISTRY):
        return False
    return all(before in order[:k] for k, name in enumerate(order) for before in PRECEDENCE[name])


def moved(order: Sequence[str], name: str, *, after: str) -> tuple[str, ...]:
    """Return `order` with the sub-task `name` moved to the place right after `after`."""
    rest = [step for step in order if step != name]
    place = rest.index(after) + 1
    return (*rest[:place], name, *rest[place:])


def effective(steps: Sequence[str]) -> tuple[bool, ...]:
    """Whether each of `steps` has a physical effect when all of them are carried out well.

    Turning the knob to where it is, pouring from an empty vessel and stirring an empty cup have
    none.
    """
    happened: list[str] = []
    effects = []
    for name in steps:
        effects.append(has_effect(name, happened))
        if effects[-1]:
            happened.append(name)
    return tuple(effects)


def has_effect(name: str, done: Sequence[str]) -> bool:
    """Whether the sub-task `name` has an effect, carried out well after the events `done`."""
    return _has_effect(find_subtask(name), [REGISTRY[before] for before in done])


def recognisable(steps: Sequence[str]) -> tuple[str, ...]:
    """Return the sub-tasks that physics recognises when all `steps` are carried out well."""
    return tuple(name for name, effect in zip(steps, effective(steps), strict=True) if effect)


def oven_is_on(done: Sequence[str]) -> bool:
    """Whether the oven is on after the sub-tasks `done`."""
    turns = [REGISTRY[name].oven for name in done]
    return turns.count(True) > turns.count(False)


def _has_effect(row: Subtask, happened: Sequence[Subtask]) -> bool:
    if row.oven is not None:
        return row.oven != oven_is_on([before.name for before in happened])
    if isinstance(row.event, Poured):
        return row not in happened
    if isinstance(row.event, Stirred):
        poured = [before.event for before in happened if isinstance(before.event, Poured)]
        return any(event.liquid for event in poured)
    return True


def random_order(rng: np.random.Generator) -> tuple[str, ...]:
    """Draw one of the legal orders, all equally likely."""
    while True:
        order = tuple(ROWS[k].name for k in rng.permutation(len(ROWS)))
        if is_legal(order):
            return order


def next_correct(done: Sequence[str]) -> str | None:
    """Return the reference's next sub-task: the first of Seq_1 not done yet, None after the last.

    A last sub-task that came too early has to be done again.
    """
    missing = [name for name in SEQ_1 if name not in done]
    if missing:
        return missing[0]
    return None if done[-1] == LAST else LAST


def allowed_next(done: Sequence[str]) -> tuple[str, ...]:
    """Return every sub-task that the precedence allows next and that is still needed."""
    open_steps = [name for name in REGISTRY if name not in done]
    if not open_steps:
        return () if done[-1] == LAST else (LAST,)
    allowed = [name for name in open_steps if all(p in done for p in PRECEDENCE[name])]
    if not allowed and LAST in done:  # done too early, and the rest waits for nothing
        return (LAST,)
    return tuple(allowed)
