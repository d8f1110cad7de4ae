"""Equation 3 along one path of falling temperature, the default solver.

It adds the entropy term tau * sum_d [w log w + (1 - w) log(1 - w)]. For fixed lambda the optimal
weights are then w_d = sigmoid((nu - l_d) / tau) with nu from sum w = M. tau goes from large (all
demonstrations count alike) to small (the M most consistent ones count): one smooth path that starts
at the whole pool's majority, where the plain problem has many local optima. The end of the path is
hardened: the value is concave in w, so its least lies where all weights but one are 0 or 1.

In a small pool without a clear majority the path may end beside the optimum. There the models of
all pairs of demonstrations are starts as well, and the best end is improved by exchanges.
"""

from itertools import combinations

import numpy as np
from scipy.optimize import brentq
from scipy.special import expit

from filtering.judging.equation3.problem import Multipliers, Problem
from filtering.judging.equation3.solver import (
    LEAST_GAIN,
    Array,
    Solution,
    Solver,
    concentrate,
    fill,
    thinned,
)

TAU_FIRST = 1.0
"""First temperature [nats per step]: well above the spread of the losses, w is nearly uniform."""
TAU_LAST = 0.02
"""Last temperature [nats per step]: well below what one defect adds to a demonstration's mean."""
TAU_COUNT = 16
"""Number of temperatures, geometrically spaced."""
INNER_STEPS = 20
"""Most alternations between lambda and w at one temperature."""
WEIGHT_TOLERANCE = 1e-3
"""Largest change of a weight at which a temperature counts as solved."""
MOST_FOR_SEARCH = 32
"""With so few different demonstrations, pairs are starts too and exchanges are tried at the end."""
PAIRS = 8
"""Pairs that are finished: those whose model fits its M best demonstrations best."""
PAIR_PRECISION = 1e-2
"""How precisely lambda is solved for to compare pairs."""
MOST_FOR_PATH = 500
"""The path is walked with at most so many different demonstrations."""
PATH_PRECISION = 1e-7
"""How precisely lambda is solved for on the way; the end is solved to the full."""


class Annealed(Solver):
    """Solves equation 3 along one path of falling temperature."""

    def solve_kinds(self, problem: Problem, sizes: Array, trusted: float) -> Solution:
        """Solve for K different demonstrations, `sizes` (K,) of each."""
        multipliers, solved = _walk(problem, sizes, trusted)
        small = len(sizes) <= MOST_FOR_SEARCH
        starts, tried = _pairs(problem, sizes, trusted) if small else ([], 0)
        ends = []
        for start in [multipliers, *starts]:
            multipliers, weights, steps = concentrate(problem, sizes, trusted, start)
            ends.append((problem.objective(multipliers, weights), multipliers, weights))
            solved += steps
        _, multipliers, weights = min(ends, key=lambda end: end[0])
        if small:
            multipliers, weights, steps = _swap(problem, sizes, trusted, multipliers, weights)
            solved += steps
        return Solution(multipliers, weights, True, solved + tried)


def _walk(problem: Problem, sizes: Array, trusted: float) -> tuple[Multipliers, int]:
    """Return lambda at the end of the path, and how often it was solved for.

    In a large pool some demonstrations, evenly spread over what they do, show the way as well.
    """
    some = thinned(len(sizes), MOST_FOR_PATH)
    if len(some) < len(sizes):
        trusted *= sizes[some].sum() / sizes.sum()
        problem, sizes = problem.only(some), sizes[some]
    weights = sizes * trusted / sizes.sum()
    multipliers = problem.solve(weights, precision=PATH_PRECISION)
    solved = 1
    for tau in np.geomspace(TAU_FIRST, TAU_LAST, TAU_COUNT):
        multipliers, weights, steps = _settle(
            problem, sizes, trusted, float(tau), multipliers, weights
        )
        solved += steps
    return multipliers, solved


def _settle(
    problem: Problem,
    sizes: Array,
    trusted: float,
    tau: float,
    multipliers: Multipliers,
    weights: Array,
) -> tuple[Multipliers, Array, int]:
    """Alternate between w and lambda at one temperature until w stands still."""
    for step in range(1, INNER_STEPS + 1):  # noqa: B007
        update = trust(problem.demo_losses(multipliers), sizes, trusted, tau)
        change = (np.abs(update - weights) / sizes).max()
        weights = update
        multipliers = problem.solve(weights, multipliers, PATH_PRECISION)
        if change < WEIGHT_TOLERANCE:
            break
    return multipliers, weights, step


def _pairs(problem: Problem, sizes: Array, trusted: float) -> tuple[list[Multipliers], int]:
    """Return lambda of the most promising pairs of demonstrations, and how many pairs there are."""
    ends = []
    for pair in combinations(range(len(sizes)), 2):
        chosen = np.zeros(len(sizes))
        chosen[list(pair)] = 1.0
        multipliers = problem.solve(chosen, precision=PAIR_PRECISION)
        losses = problem.demo_losses(multipliers)
        ends.append((float(fill(losses, sizes, trusted) @ losses), multipliers))
    best = sorted(ends, key=lambda end: end[0])[:PAIRS]
    return [multipliers for _, multipliers in best], len(ends)


def _swap(
    problem: Problem, sizes: Array, trusted: float, multipliers: Multipliers, weights: Array
) -> tuple[Multipliers, Array, int]:
    """Exchange one trusted demonstration for another while that lowers the value."""
    value, solved, improved = problem.objective(multipliers, weights), 0, True
    while improved:
        improved = False
        for one, other in _exchanges(problem.demo_losses(multipliers), sizes, weights):
            amount = min(weights[one], sizes[other] - weights[other])
            tried = weights.copy()
            tried[one] -= amount
            tried[other] += amount
            found = problem.solve(tried, multipliers)
            solved += 1
            if problem.objective(found, tried) < value - LEAST_GAIN:
                multipliers, weights, steps = concentrate(problem, sizes, trusted, found)
                value, solved, improved = (
                    problem.objective(multipliers, weights),
                    solved + steps,
                    True,
                )
                break
    return multipliers, weights, solved


def _exchanges(losses: Array, sizes: Array, weights: Array) -> list[tuple[int, int]]:
    """Return who could be trusted less and who more in exchange, the most promising first."""
    less, more = np.flatnonzero(weights > 0).tolist(), np.flatnonzero(weights < sizes).tolist()
    pairs = [(one, other) for one in less for other in more if one != other]
    return sorted(pairs, key=lambda pair: losses[pair[1]] - losses[pair[0]])


def trust(losses: Array, sizes: Array, trusted: float, tau: float) -> Array:
    """Return v (K,) = sizes * sigmoid((nu - losses) / tau), with nu such that sum v = M."""
    reach = tau * (np.log(sizes.sum()) + 40.0)

    def excess(nu: float) -> float:
        return float(sizes @ expit((nu - losses) / tau) - trusted)

    nu = brentq(excess, losses.min() - reach, losses.max() + reach, xtol=1e-14)
    weights: Array = sizes * expit((nu - losses) / tau)
    return weights
