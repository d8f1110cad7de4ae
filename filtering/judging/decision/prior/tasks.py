"""Random procedural tasks: partial orders of steps, some of them optional.

Tasks are drawn from a prior alone; no data set is read. A node is one occurrence of a step in the
recipe: two nodes may have the same label.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from teasim.common.arrays import Array

FEWEST_STEPS, MOST_STEPS = 4, 26
"""Range of the number of steps of a task, drawn log-uniformly."""
FOREIGN = 3
"""Largest number of foreign steps; they are the nodes -1, -2, -3."""
OPTIONS = ("each", "all or none", "one missing", "one of them")
"""How a demonstration chooses its optional steps."""
OPTION_SHARES = (0.55, 0.15, 0.15, 0.15)
"""How often tasks have each of OPTIONS."""


@dataclass(frozen=True)
class Task:
    """A task of n nodes."""

    before: NDArray[np.bool_]
    """(n, n) True where the node of the row has to come before that of the column; transitive."""
    chunk: NDArray[np.int64]
    """(n,) part of the task that a node belongs to; people tend to finish a part."""
    labels: NDArray[np.int64]
    """(n,) step of each node."""
    chance: Array
    """(n,) probability that a correct demonstration has a node; 1 for mandatory ones."""
    lengths: Array
    """(n,) usual duration [frames]."""
    n_labels: int
    """Number of steps; numbers from here on are foreign steps."""
    options: str = OPTIONS[0]
    """One of OPTIONS."""
    foreign: int = 1
    """Number of foreign steps that people may add."""

    def violated(self, order: list[int]) -> bool:
        """Whether an order of nodes breaks the precedence; negative nodes are foreign."""
        nodes = [node for node in order if node >= 0]
        return bool(np.tril(self.before[np.ix_(nodes, nodes)], -1).any())


def draw_task(rng: np.random.Generator, *, exact: bool) -> Task:
    """Draw a task; in exact ones, as scripts and robots follow them, hardly anything is free."""
    steps = round(np.exp(rng.uniform(np.log(FEWEST_STEPS), np.log(MOST_STEPS))))
    twice = int(rng.integers(1, 3)) if steps > 5 and rng.random() < 0.2 else 0
    n = steps + twice
    shares = [0.75, 0.1, 0.05, 0.1] if exact else [0.1, 0.37, 0.23, 0.3]
    before, chunk = SHAPES[int(rng.choice(len(SHAPES), p=shares))](rng, n)
    if rng.random() < 0.5:  # a fixed beginning or end
        head, tail = rng.integers(0, max(2, n // 3), 2)
        before[:head] |= np.arange(head)[:, None] < np.arange(n)
        before[:, n - tail :] |= np.arange(n)[:, None] < np.arange(n - tail, n)
    for via in range(n):
        before |= before[:, via, None] & before[None, via, :]
    labels = np.arange(n)
    if twice:
        again = rng.choice(n, twice, replace=False)
        labels[np.setdiff1d(np.arange(n), again)] = np.arange(steps)
        labels[again] = rng.integers(0, steps, twice)
    spread = rng.choice([0.0, 0.4, 0.8])
    lengths = np.exp(rng.normal(rng.uniform(2.0, 4.5), spread, n))
    options = str(rng.choice(OPTIONS, p=OPTION_SHARES))
    foreign = int(rng.integers(1, FOREIGN + 1))
    return Task(before, chunk, labels, _chances(rng, n, exact), lengths, steps, options, foreign)


def _chances(rng: np.random.Generator, n: int, exact: bool) -> Array:
    chance = np.ones(n)
    if rng.random() < (0.35 if exact else 0.5):
        count = min(n - 3, int(rng.choice([1, 1, 2, 2, 3, 4, 5])))
        # A step of a script that few leave out, or that few do, is a mistake of those few.
        range_ = (0.4, 0.75) if exact else (0.2, 0.8)
        chance[rng.choice(n, count, replace=False)] = rng.uniform(*range_, count)
    return chance


Shape = tuple[NDArray[np.bool_], NDArray[np.int64]]
"""Pairs that have an order (n, n), and the part of each node (n,)."""


def _line(rng: np.random.Generator, n: int) -> Shape:
    before = np.triu(np.ones((n, n), bool), 1)
    for place in rng.integers(n - 1, size=int(rng.choice([0, 0, 0, 1, 2]))):
        before[place, place + 1] = False
    return before, np.zeros(n, np.int64)


def _series_parallel(rng: np.random.Generator, n: int) -> Shape:
    before, chunk = np.zeros((n, n), bool), np.zeros(n, np.int64)
    series = rng.uniform(0.1, 0.9)
    left = [np.arange(n)]
    while left:
        nodes = left.pop()
        parts = min(len(nodes), int(rng.integers(2, 5)))
        cuts = np.sort(rng.choice(np.arange(1, len(nodes)), parts - 1, replace=False))
        groups = np.split(nodes, cuts)
        if rng.random() < series:
            for first, second in pairwise(groups):
                before[np.ix_(first, second)] = True
        else:
            for group in groups:
                chunk[group] = chunk.max() + 1
        left += [group for group in groups if len(group) > 1]
    return before, chunk


def _random(rng: np.random.Generator, n: int) -> Shape:
    free = np.triu(rng.random((n, n)) < rng.uniform(0.0, 0.8), 1)
    return free, np.zeros(n, np.int64)


def _chains(rng: np.random.Generator, n: int) -> Shape:
    chunk = np.cumsum(rng.random(n) < 1 / rng.uniform(1, 4), dtype=np.int64)
    chunk -= chunk[0]
    parts = chunk.max() + 1
    above = np.triu(rng.random((parts, parts)) < rng.uniform(0, 0.6), 1)
    inside = np.triu(np.ones((n, n), bool), 1) & (chunk[:, None] == chunk)
    return above[chunk][:, chunk] | inside, chunk


SHAPES = (_line, _series_parallel, _random, _chains)
"""How the order of a task is drawn: one line, nested parts, any pairs, or chains."""
