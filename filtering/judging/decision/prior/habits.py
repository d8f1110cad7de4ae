"""How people do a task: the optional steps they choose, and their order of the steps left free."""

from dataclasses import dataclass

import numpy as np

from filtering.judging.decision.prior.tasks import Task
from teasim.common.arrays import Array


@dataclass(frozen=True)
class Habit:
    """How a person orders steps that the task leaves free."""

    rank: Array
    """(n,) position of each node in the preferred order."""
    closeness: float
    """Rate of the exponential distribution of the distance from the preferred next step."""
    stick: float
    """Probability to go on with the part of the task that was begun."""


def draw_habit(rng: np.random.Generator, task: Task, *, closeness: float, stick: float) -> Habit:
    """Draw a person's preferred order."""
    n = len(task.labels)
    order = draw_order(rng, task, Habit(rng.random(n), 0.0, stick), list(range(n)))
    rank = np.empty(n)
    rank[order] = np.arange(n)
    return Habit(rank, closeness, stick)


def draw_present(rng: np.random.Generator, task: Task) -> list[int]:
    """Draw the nodes of one correct demonstration."""
    free = np.flatnonzero(task.chance < 1)
    present = np.ones(len(task.chance), bool)
    if not len(free):
        return list(range(len(present)))
    chance = task.chance[free]
    if task.options == "all or none":
        present[free] = rng.random() < chance.mean()
    elif task.options == "one missing":
        present[rng.choice(free)] = rng.random() < chance.mean()
    elif task.options == "one of them":
        present[free] = False
        present[rng.choice(free, p=chance / chance.sum())] = True
    else:
        present[free] = rng.random(len(free)) < chance
    return np.flatnonzero(present).tolist()


def draw_order(rng: np.random.Generator, task: Task, habit: Habit, present: list[int]) -> list[int]:
    """Draw an order of the nodes `present`: of those that may come next, one near to the habit."""
    left = sorted(present, key=lambda node: habit.rank[node])
    waiting = task.before[np.ix_(left, left)].sum(axis=0).tolist()
    waits = dict(zip(left, waiting, strict=True))
    order: list[int] = []
    while left:
        free = [node for node in left if not waits[node]]
        if order and rng.random() < habit.stick:
            part = task.chunk[order[-1]]
            free = [node for node in free if task.chunk[node] == part] or free
        order.append(_next(rng, free, habit.closeness))
        left.remove(order[-1])
        for node in left:
            waits[node] -= int(task.before[order[-1], node])
    return order


def _next(rng: np.random.Generator, free: list[int], closeness: float) -> int:
    if len(free) == 1 or closeness > 20:
        return free[0]
    if closeness < 0.02:
        return free[int(rng.integers(len(free)))]
    return free[min(int(rng.exponential(1 / closeness)), 10**6) % len(free)]
