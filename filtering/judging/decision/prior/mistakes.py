"""What incorrect demonstrations do: chance mistakes, and recipes that a minority shares."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.judging.decision.prior.tasks import Task

TRIES = 12
"""Attempts to make a mistake that breaks the precedence."""
Order = list[int]
"""Nodes in the order in which they are done."""


def omit(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Leave out one to three mandatory steps."""
    must = _mandatory(task, order)
    if len(order) < 3 or not must:
        return None
    count = min(int(rng.choice([1, 1, 1, 2, 2, 3])), len(must), len(order) - 2)
    out = set(rng.choice(must, count, replace=False).tolist())
    return [node for node in order if node not in out]


def stop(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Stop before the last one to three steps."""
    cut = int(rng.integers(1, 4))
    if len(order) - cut < 2 or not _mandatory(task, order[-cut:]):
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
    must = _mandatory(task, order)
    if not must:
        return None
    out = int(rng.choice(must))
    return [_foreign(rng, task) if node == out else node for node in order]


def add(rng: np.random.Generator, task: Task, order: Order) -> Order | None:
    """Do a foreign step in addition."""
    place = int(rng.integers(len(order) + 1))
    return [*order[:place], _foreign(rng, task), *order[place:]]


def repeat(rng: np.random.Generator, _task: Task, order: Order) -> Order | None:
    """Do a step again later, not directly after itself."""
    if len(order) < 3:
        return None
    first = int(rng.integers(len(order) - 1))
    place = int(rng.integers(first + 2, len(order) + 1))
    return [*order[:place], order[first], *order[place:]]


Mistake = Callable[[np.random.Generator, Task, Order], Order | None]
"""Makes one mistake in an order; None where it cannot be made."""
KINDS: tuple[Mistake, ...] = (omit, move, swap, substitute, add, repeat, stop)
"""Every kind of mistake."""
SHARES = np.array([0.34, 0.24, 0.08, 0.05, 0.12, 0.11, 0.06])
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


@dataclass(frozen=True)
class Recipe:
    """What a minority does instead, as a function of a correct order."""

    omitted: tuple[int, ...]
    """Nodes that are left out."""
    moves: tuple[tuple[tuple[int, ...], int], ...]
    """Blocks of nodes and the node after which each is done."""
    added: tuple[int, int] | None
    """A node that is done in addition, and the node after which."""
    each: float
    """Probability that an omitted node is left out; at least one is."""

    def follow(self, rng: np.random.Generator, task: Task, order: Order) -> tuple[Order, bool]:
        """Return the order of the minority, and whether it is incorrect."""
        out = {node for node in self.omitted if rng.random() < self.each}
        if self.omitted and not out:
            out = {int(rng.choice(self.omitted))}
        new = [node for node in order if node not in out]
        for block, after in self.moves:
            if after in new:
                rest = [node for node in new if node not in block]
                place = rest.index(after) + 1
                new = [*rest[:place], *(node for node in block if node in new), *rest[place:]]
        if self.added and self.added[1] in new:
            place = new.index(self.added[1]) + 1
            new = [*new[:place], self.added[0], *new[place:]]
        wrong = new != order and (len(new) != len(order) or task.violated(new))
        return (new, True) if wrong and len(new) >= 2 else (order, False)


def draw_recipe(rng: np.random.Generator, task: Task, order: Order) -> Recipe:
    """Draw the recipe of a minority of people whose correct order would be `order`."""
    kind = rng.choice(["omits", "moves", "both", "adds"], p=[0.4, 0.4, 0.12, 0.08])
    omitted = _omitted(rng, task, order) if kind in ("omits", "both") else ()
    moves = _moves(rng, task, [n for n in order if n not in omitted]) if kind != "omits" else ()
    added = None
    if kind == "adds":
        moves = ()
        again = int(rng.choice(order)) if rng.random() < 0.5 else _foreign(rng, task)
        others = [node for node in order if node != again]
        added = (again, int(rng.choice(others)))
    return Recipe(omitted, moves, added, float(rng.choice([1.0, rng.uniform(0.3, 1)])))


def _omitted(rng: np.random.Generator, task: Task, order: Order) -> tuple[int, ...]:
    must = _mandatory(task, order)
    if len(must) < 3:
        return ()
    most = max(2, min(8, len(must) // 2) + 1)
    count = int(rng.integers(1, most if rng.random() < 0.5 else min(most, 4)))
    if rng.random() < 0.5:  # neighbours: a part of the task
        start = int(rng.integers(len(must) - count + 1))
        return tuple(must[start : start + count])
    return tuple(rng.choice(must, count, replace=False).tolist())


def _moves(
    rng: np.random.Generator, task: Task, kept: Order
) -> tuple[tuple[tuple[int, ...], int], ...]:
    moves = []
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        for _ in range(TRIES):
            size = int(rng.choice([1, 1, 2]))
            if len(kept) <= size + 1:
                break
            start = int(rng.integers(len(kept) - size + 1))
            block, rest = kept[start : start + size], kept[:start] + kept[start + size :]
            place = int(rng.integers(len(rest)))
            new = rest[: place + 1] + block + rest[place + 1 :]
            if new != kept and task.violated(new):
                moves.append((tuple(block), rest[place]))
                kept = new
                break
    return tuple(moves)


def _mandatory(task: Task, order: Order) -> Order:
    return [node for node in order if node >= 0 and task.chance[node] == 1]


def _foreign(rng: np.random.Generator, task: Task) -> int:
    return -1 - int(rng.integers(task.foreign))


def _broken(task: Task, order: Order, change: Callable[[], Order]) -> Order | None:
    """Return the first change that breaks the precedence, None if there is none."""
    for _ in range(TRIES if len(order) > 2 else 0):
        new = change()
        if new != order and task.violated(new):
            return new
    return None
