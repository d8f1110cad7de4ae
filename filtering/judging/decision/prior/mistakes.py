"""What incorrect demonstrations do by chance."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from filtering.judging.decision.prior.tasks import Task

TRIES = 12
"""Attempts to make a mistake that breaks the precedence."""
Order = list[int]
"""Nodes in the order in which they are done."""


def omit(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Leave out one to three mandatory steps."""
    must = mandatory(task, order)
    if len(order) < 3 or not must:
        return None
    count = min(int(rng.choice([1, 1, 1, 2, 2, 3])), len(must), len(order) - 2)
    out = set(rng.choice(must, count, replace=False).tolist())
    return [node for node in order if node not in out] or None  # a step may be there twice


def skip(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Leave out a part of the task: two to six neighbours."""
    size = int(rng.integers(2, 7))
    if len(order) < size + 2:
        return None
    start = int(rng.integers(len(order) - size + 1))
    if not mandatory(task, order[start : start + size]):
        return None
    return [*order[:start], *order[start + size :]]


def stop(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Stop before the last one to three steps."""
    cut = int(rng.integers(1, 4))
    if len(order) - cut < 2 or not mandatory(task, order[-cut:]):
        return None
    return order[:-cut]


def move(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Do a step, or a few neighbours, at a wrong time."""

    def moved() -> Order:
        size = min(int(rng.choice([1, 1, 1, 2, 3])), len(order) - 1)
        start = int(rng.integers(len(order) - size + 1))
        rest = order[:start] + order[start + size :]
        near = int(np.clip(start + rng.choice([-3, -2, -1, 1, 2, 3]), 0, len(rest)))
        target = int(rng.choice([near, int(rng.integers(len(rest) + 1)), 0, len(rest)]))
        return rest[:target] + order[start : start + size] + rest[target:]

    return _broken(task, order, moved)


def swap(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Exchange two steps."""

    def swapped() -> Order:
        i, j = rng.choice(len(order), 2, replace=False)
        new = list(order)
        new[i], new[j] = new[j], new[i]
        return new

    return _broken(task, order, swapped)


def substitute(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Do a foreign step in place of a mandatory one."""
    must = mandatory(task, order)
    if not must:
        return None
    out = int(rng.choice(must))
    return [foreign(rng, task) if node == out else node for node in order]


def add(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Do a foreign step in addition."""
    place = int(rng.integers(len(order) + 1))
    return [*order[:place], foreign(rng, task), *order[place:]]


def repeat(rng: np.random.Generator, _task: Task, order: Order) -> Order | None:
    """Do a step again later, not directly after itself."""
    if len(order) < 3:
        return None
    first = int(rng.integers(len(order) - 1))
    place = int(rng.integers(first + 2, len(order) + 1))
    return [*order[:place], order[first], *order[place:]]


Mistake = Callable[[np.random.Generator, Task, Order], Order | None]
"""Makes one mistake in an order; None where it cannot be made."""
KINDS: tuple[Mistake, ...] = (omit, move, swap, substitute, add, repeat, stop, skip)
"""Every kind of mistake."""
SHARES = np.array([0.30, 0.22, 0.07, 0.05, 0.12, 0.11, 0.04, 0.09])
"""Mean share of each kind; every pool draws its own shares around it."""


def make_mistakes(
    rng: np.random.Generator, task: Task, order: Order, shares: NDArray[np.float64], more: float
) -> tuple[Order, bool]:
    """Return the order with 1 + Poisson(`more`) mistakes, and whether there is any."""
    made = 0
    wanted = 1 + rng.poisson(more)
    for _ in range(3 * TRIES):
        new = KINDS[int(rng.choice(len(KINDS), p=shares))](rng, task, order)
        if new is not None:
            order, made = new, made + 1
        if made == wanted:
            break
    return order, made > 0


def mandatory(task: Task, order: Order) -> Order:
    """Return the nodes of an order that no correct demonstration leaves out."""
    return [node for node in order if node >= 0 and task.chance[node] == 1]


def foreign(rng: np.random.Generator, task: Task) -> int:
    """Draw a foreign step."""
    return -1 - int(rng.integers(task.foreign))


def _broken(task: Task, order: Order, change: Callable[[], Order]) -> Order | None:
    """Return the first change that breaks the precedence, None if there is none."""
    for _ in range(TRIES if len(order) > 2 else 0):
        new = change()
        if new != order and task.violated(new):
            return new
    return None
