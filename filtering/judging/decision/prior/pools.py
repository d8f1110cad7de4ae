"""Pools of demonstrations of a random task, with the truth about each demonstration.

The prior over what is honest and what is not:

* Styles: scripts that are followed exactly, a few people with one order each, and people who vary
  around a habit, much or little.
* A minority that does one other thing in a pool of scripts is incorrect, and half of the pool or
  more is correct; a few people with an order each are honest, and none of their orders has a
  majority. Nobody shares an incorrect recipe there: it would be the order of one more person.
* Incorrect demonstrations make chance mistakes, or share the recipe of a minority, or both kinds
  occur in one pool. Seldom most of the pool is incorrect.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from filtering.judging.decision.observed import Observed
from filtering.judging.decision.prior.effects import Sight, draw_sight, surprises
from filtering.judging.decision.prior.mistakes import SHARES, make_mistakes
from filtering.judging.decision.prior.noise import (
    Noise,
    Report,
    draw_noise,
    reliabilities,
    report,
)
from filtering.judging.decision.prior.people import People, draw_people
from filtering.judging.decision.prior.recipes import draw_recipe
from filtering.judging.decision.prior.tasks import FOREIGN, Task
from teasim.common.arrays import Array

FEWEST_DEMOS, MOST_DEMOS = 4, 60
"""Range of the number of demonstrations, drawn log-uniformly."""
FEW_ORDERS = 0.9
"""Share of the pools drawn anew because their correct demonstrations, although free to vary, show
two or three orders only: people vary in many ways or not at all."""
NOISY = 0.2
"""Errors of the segmenter per step from which a pool counts as noisy."""
CORRECT, INCORRECT, INEFFECTIVE = 0, 1, 2
"""Truth of a demonstration: correct, incorrect in its steps, or only a step without effect."""
FACTS = ("clean", "noisy", "majority incorrect", "several ways")
"""What is true of a pool as a whole."""


@dataclass(frozen=True)
class DrawnPool:
    """A pool and the truth about it."""

    observed: Observed
    """What the decision reads."""
    incorrect: NDArray[np.bool_]
    """(D,) whether each demonstration is incorrect."""
    facts: NDArray[np.bool_]
    """(4,) which of FACTS are true."""


@dataclass(frozen=True)
class Group:
    """Demonstrations of a pool that are incorrect in one way."""

    count: int
    """Number of demonstrations."""
    shared: bool
    """Whether they share a recipe; otherwise each makes mistakes by chance."""


def draw_pool(
    rng: np.random.Generator, *, n_demos: int | None = None, clean: bool | None = None
) -> DrawnPool:
    """Draw a pool.

    Args:
        rng: source of randomness.
        n_demos: D; drawn by default.
        clean: whether nothing is incorrect; by default a share of the pools is, see `People`.
    """
    size = rng.uniform(np.log(FEWEST_DEMOS), np.log(MOST_DEMOS))
    n_demos = n_demos or round(np.exp(size))
    while True:
        people = draw_people(rng)
        nothing = rng.random() < people.clean if clean is None else clean
        groups = [] if nothing else draw_groups(rng, n_demos, people.style)
        orders, truth = _draw_orders(rng, people, groups, n_demos)
        if not _ambiguous(rng, people, orders, truth != CORRECT):
            return _observe(rng, people, orders, truth)


def draw_groups(rng: np.random.Generator, n_demos: int, style: str) -> list[Group]:
    """Draw how many are incorrect in which ways."""
    groups = _draw_sharing(rng, n_demos, style == "script")
    return [Group(group.count, False) for group in groups] if style == "orders" else groups


def _draw_sharing(rng: np.random.Generator, n_demos: int, script: bool) -> list[Group]:
    """Draw the groups of people who may share an incorrect recipe."""
    kind = rng.random()
    if kind < 0.04:  # most of them, in the same way
        most = int(rng.uniform(0.52, 0.75) * n_demos)
        return [Group(max(most, 1), True)]
    if n_demos >= 7 and kind < (0.26 if script else 0.08):
        first = rng.uniform(0.15, 0.34)
        second = rng.uniform(0.08, min(0.25, 0.5 - first))
        counts = [max(1, round(share * n_demos)) for share in (first, second)]
        return [Group(counts[0], True), Group(counts[1], bool(rng.random() < 0.6))]
    regime = rng.random()
    count = int(rng.integers(1, int(0.6 * n_demos) + 1))
    count = 1 if regime < 0.22 else 2 if regime < 0.32 else count
    count = min(count, max(1, int(0.6 * n_demos)))
    shared = count > 1 and rng.random() < (0.62 if script else 0.2)
    return [Group(min(count, max(1, int(0.47 * n_demos))) if shared else count, bool(shared))]


def _draw_orders(
    rng: np.random.Generator, people: People, groups: list[Group], n_demos: int
) -> tuple[list[list[int]], NDArray[np.int64]]:
    """Return an order of nodes per demonstration, and whether it is incorrect or ineffective."""
    task = people.task
    shares = rng.dirichlet(SHARES * 3)
    more = float(rng.choice([0.0, 0.7, 2.0, 4.0], p=[0.2, 0.25, 0.3, 0.25]))
    orders: list[list[int]] = []
    truth = np.full(n_demos, CORRECT)
    for group in groups:
        recipe = draw_recipe(rng, task, people.order(rng)) if group.shared else None
        for _ in range(group.count):
            order, wrong = people.order(rng), False
            if recipe is not None:
                order, wrong = recipe.follow(rng, task, order)
            useless = not wrong and rng.random() < people.ineffective
            if not wrong and not useless:
                order, wrong = make_mistakes(rng, task, order, shares, 0 if recipe else more)
            truth[len(orders)] = INEFFECTIVE if useless else wrong
            orders.append(order)
    while len(orders) < n_demos:
        orders.append(people.order(rng))
    return orders[:n_demos], truth


def _ambiguous(
    rng: np.random.Generator, people: People, orders: list[list[int]], incorrect: NDArray[np.bool_]
) -> bool:
    """Whether honest variety looks like a minority, which is left out of the prior."""
    largest, kinds = _largest_way(people.task, orders, incorrect)
    honest = int((~incorrect).sum())
    style = people.style
    if style == "script":
        return False
    if style == "orders":
        return kinds > 1 and largest > 0.55 * honest
    return 1 < kinds <= min(3, honest // 3) and rng.random() < FEW_ORDERS


def _largest_way(
    task: Task, orders: list[list[int]], incorrect: NDArray[np.bool_]
) -> tuple[int, int]:
    """Return how many correct demonstrations share one order at most, and how many orders.

    Optional steps do not count: who leaves one out does not do the others in another order.
    """
    counts: dict[tuple[int, ...], int] = {}
    for order, wrong in zip(orders, incorrect, strict=True):
        if not wrong:
            must = tuple(node for node in order if task.chance[node] == 1)
            counts[must] = counts.get(must, 0) + 1
    return max(counts.values(), default=0), len(counts)


def _observe(
    rng: np.random.Generator, people: People, orders: list[list[int]], truth: NDArray[np.int64]
) -> DrawnPool:
    """Let a segmenter report a pool, and shuffle it."""
    noise = draw_noise(rng, people.task.n_labels + FOREIGN, exact=people.style == "script")
    reports = [_report(rng, people.task, noise, order) for order in orders]
    effects = reliability = None
    if people.effects:
        useless = truth == INEFFECTIVE
        effects = tuple(map(partial(_effects, rng, draw_sight(rng)), reports, useless))
    if noise.trust > 0:
        reliability = tuple(reliabilities(rng, noise, found.right) for found in reports)
    steps = tuple(found.steps for found in reports)
    pool = Observed(steps, reliability, effects, noise.told)
    errors = sum(found.errors for found in reports) / sum(map(len, orders))
    incorrect = truth != CORRECT
    honest = int((~incorrect).sum())
    largest, _ = _largest_way(people.task, orders, incorrect)
    facts = [not incorrect.any(), errors >= NOISY, honest < len(orders) / 2, largest <= honest / 2]
    shuffled = rng.permutation(len(orders))
    return DrawnPool(pool.chosen(shuffled), incorrect[shuffled], np.array(facts))


def _report(rng: np.random.Generator, task: Task, noise: Noise, order: list[int]) -> Report:
    known = np.array([node >= 0 for node in order])
    nodes = np.where(known, order, 0)
    labels = np.where(known, task.labels[nodes], task.n_labels - 1 - np.array(order))
    usual = np.where(known, task.lengths[nodes], np.median(task.lengths))
    return report(rng, task, noise, labels.tolist(), usual)


def _effects(rng: np.random.Generator, sight: Sight, found: Report, useless: bool) -> Array:
    """Draw the effects of one demonstration, of which one step may be ineffective."""
    ineffective = np.zeros(len(found.steps.labels), bool)
    if useless:
        ineffective[int(rng.integers(len(ineffective)))] = True
    return surprises(rng, sight, ineffective)
