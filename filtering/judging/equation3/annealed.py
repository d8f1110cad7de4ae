"""Equation 3 by deterministic annealing, the default solver.

It adds the entropy term tau * sum_d [w log w + (1 - w) log(1 - w)]. For fixed lambda the optimal
weights are then w_d = sigmoid((nu - l_d) / tau) with nu from sum w = M. tau falls from a large
value (all demonstrations have equal weights) to a small one (the M most consistent ones are
trusted). This smooth path starts at the majority of the whole pool, whereas the problem without
entropy has many local optima. The end of the path is rounded: the value is concave in w, so its
minimum is where all weights but one are 0 or 1.

In a small pool without a clear majority the path may miss the optimum. Then the models of all pairs
of demonstrations are used as further starts, and the best solution is improved by exchanges.
"""

from itertools import combinations

import numpy as np

from filtering.judging.equation3.problem import Multipliers, Problem
from filtering.judging.equation3.solver import (
    LEAST_GAIN,
    Solver,
    SolverResult,
    concentrate,
    fill,
    thinned,
)
from teasim.common.arrays import Array
from teasim.common.trimming import soft_trim

TAU_FIRST = 1.0
"""First temperature [nats per step]: well above the spread of the losses, so that w is
nearly uniform."""
TAU_LAST = 0.02
"""Last temperature [nats per step]: well below what one mistake adds to a mean loss."""
TAU_COUNT = 16
"""Number of temperatures, geometrically spaced."""
INNER_STEPS = 20
"""Largest number of alternations between lambda and w at one temperature."""
WEIGHT_TOLERANCE = 1e-3
"""Largest change of a weight at which a temperature counts as solved."""
MOST_FOR_SEARCH = 32
"""Largest number of different demonstrations for which pairs and exchanges are tried."""
PAIRS = 8
"""Pairs that are refined: those whose models fit M demonstrations best."""
PAIR_PRECISION = 1e-2
"""Relative precision of lambda when pairs are compared."""
MOST_FOR_PATH = 500
"""Largest number of different demonstrations on the path."""
PATH_PRECISION = 1e-7
"""Relative precision of lambda on the path; the end is solved to full precision."""


class Annealed(Solver):
    """Solves equation 3 by deterministic annealing."""

    def solve_distinct(self, problem: Problem, sizes: Array, trusted: float) -> SolverResult:
        """Solve for K different demonstrations with `sizes` (K,) copies of each."""
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
        return SolverResult(multipliers, weights, True, solved + tried)


def _walk(problem: Problem, sizes: Array, trusted: float) -> tuple[Multipliers, int]:
    """Return lambda at the end of the path, and how often it was solved for.

    In a large pool a subset of the demonstrations, evenly spread over their contents, is used.
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
            problem, sizes, trusted, multipliers, weights, tau=float(tau)
        )
        solved += steps
    return multipliers, solved


def _settle(
    problem: Problem,
    sizes: Array,
    trusted: float,
    multipliers: Multipliers,
    weights: Array,
    *,
    tau: float,
) -> tuple[Multipliers, Array, int]:
    """Alternate between w and lambda at one temperature until w is constant."""
    for step in range(1, INNER_STEPS + 1):  # noqa: B007
        update = sizes * soft_trim(problem.demo_losses(multipliers), sizes, trusted, tau)
        change = (np.abs(update - weights) / sizes).max()
        weights = update
        multipliers = problem.solve(weights, multipliers, PATH_PRECISION)
        if change < WEIGHT_TOLERANCE:
            break
    return multipliers, weights, step


def _pairs(problem: Problem, sizes: Array, trusted: float) -> tuple[list[Multipliers], int]:
    """Return lambda of the best pairs of demonstrations, and the number of all pairs."""
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
    """Exchange one trusted demonstration for another while this lowers the value."""
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
    """Return pairs (less trusted, more trusted) that could be exchanged, the best ones first."""
    less, more = np.flatnonzero(weights > 0).tolist(), np.flatnonzero(weights < sizes).tolist()
    pairs = [(one, other) for one in less for other in more if one != other]
    return sorted(pairs, key=lambda pair: losses[pair[1]] - losses[pair[0]])
