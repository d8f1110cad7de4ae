"""Equation 3 by concentration steps from many random starts, as in least trimmed squares.

After FAST-LTS (Rousseeuw and Van Driessen 2006): each start trusts a few random demonstrations;
after two steps only the best starts are continued.
"""

import numpy as np

from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.solver import Solver, SolverResult, concentrate, fill
from teasim.common.arrays import Array

STARTS = 50
"""Random starts."""
DRAWN = 3
"""Largest number of demonstrations that a start trusts."""
FINISHED = 5
"""Starts that are continued to the end."""
FIRST_STEPS = 2
"""Steps after which starts are compared."""


class Alternating(Solver):
    """Solves equation 3 by alternation between w and lambda."""

    def __init__(self, seed: int = 0) -> None:
        """Keep the seed of the starts."""
        self.seed = seed

    def solve_distinct(self, problem: Problem, sizes: Array, trusted: float) -> SolverResult:
        """Solve for K different demonstrations with `sizes` (K,) copies of each."""
        rng = np.random.default_rng(self.seed)
        solved, ends = 0, []
        for _ in range(STARTS):
            drawn = np.zeros(len(sizes))
            drawn[rng.permutation(len(sizes))[:DRAWN]] = 1.0
            multipliers = problem.solve(drawn)
            multipliers, weights, steps = concentrate(
                problem, sizes, trusted, multipliers, FIRST_STEPS
            )
            solved += 1 + steps
            ends.append((problem.objective(multipliers, weights), multipliers))
        finished = []
        for _, multipliers in sorted(ends, key=lambda end: end[0])[:FINISHED]:
            multipliers, weights, steps = concentrate(problem, sizes, trusted, multipliers)
            solved += steps
            finished.append((problem.objective(multipliers, weights), multipliers, weights))
        _, multipliers, weights = min(finished, key=lambda end: end[0])
        done = np.array_equal(fill(problem.demo_losses(multipliers), sizes, trusted), weights)
        return SolverResult(multipliers, weights, done, solved)
