"""What a minority does that shares one incorrect recipe."""

from dataclasses import dataclass

import numpy as np

from filtering.judging.decision.prior.mistakes import TRIES, Order, foreign, mandatory
from filtering.judging.decision.prior.tasks import Task


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
    kind = rng.choice(["omits", "moves", "both", "adds"], p=[0.38, 0.38, 0.12, 0.12])
    omitted = _omitted(rng, task, order) if kind in ("omits", "both") else ()
    moves = _moves(rng, task, [n for n in order if n not in omitted]) if kind != "omits" else ()
    added = None
    if kind == "adds":
        moves = ()
        again = int(rng.choice(order)) if rng.random() < 0.5 else foreign(rng, task)
        others = [node for node in order if node != again]
        added = (again, int(rng.choice(others)))
    return Recipe(omitted, moves, added, float(rng.choice([1.0, rng.uniform(0.3, 1)])))


def _omitted(rng: np.random.Generator, task: Task, order: Order) -> tuple[int, ...]:
    must = mandatory(task, order)
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
