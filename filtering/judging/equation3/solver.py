"""The interface of all solvers of equation 3 over (lambda, w), and what they share.

The value of equation 3 depends only on the sum of the weights of demonstrations that are equal in
every row. So a solver is given the different demonstrations, ordered by content, and the number of
copies of each. Two properties then hold exactly for all solvers: equal demonstrations get equal
weights, and permuting the demonstrations permutes the weights.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from filtering.judging.equation3.problem import Multipliers, Problem
from teasim.common.arrays import Array
from teasim.common.errors import ConfigError

LEAST_GAIN = 1e-7
"""Improvement of the value below which iterations stop [nats per step]."""


@dataclass(frozen=True)
class SolverResult:
    """The solution over K different demonstrations."""

    multipliers: Multipliers
    """(N, T + 1) lambda."""
    weights: Array
    """(K,) v in [0, number of copies], sum v = M."""
    converged: bool
    """Whether the solver converged."""
    n_iter: int
    """Number of times that lambda was solved for."""
    lower_bound: float = -np.inf
    """Lower bound on the value of every solution [nats per step]; -inf if there is none."""
    ridge: float | None = None
    """Strength of the ridge that was used; None for that of the problem."""


class Solver(ABC):
    """Solves min over lambda, w of equation 3 with sum w = M, 0 <= w <= 1.

    After `fit`:
        weights_ (D,): w in [0, 1], sum M.
        multipliers_ (N, T + 1): lambda.
        losses_ (D,): l_d [nats per step].
        objective_: value of equation 3 with the ridge that was used [nats per step].
        lower_bound_: lower bound on the value of every solution; -inf if the solver has none.
        converged_: whether the solver converged.
        n_iter_: number of times that lambda was solved for.
    """

    weights_: Array
    multipliers_: Multipliers
    losses_: Array
    objective_: float
    lower_bound_: float
    converged_: bool
    n_iter_: int

    def fit(self, problem: Problem, trusted: float) -> Self:
        """Solve the problem.

        Args:
            problem: states and next sub-tasks of D demonstrations.
            trusted: M, number of trusted demonstrations, 0 < M < D; it need not be whole.

        Raises:
            ConfigError: M is out of range, or the problem is too large for the solver.
        """
        if not 0 < trusted < problem.rows.n_demos:
            raise ConfigError(
                f"{trusted} trusted demonstrations were asked for; choose a number between 0 and "
                f"{problem.rows.n_demos}."
            )
        numbers, firsts = distinct_demos(problem)
        sizes = np.bincount(numbers).astype(np.float64)
        found = self.solve_distinct(problem.only(firsts), sizes, float(trusted))
        ridge = problem.ridge if found.ridge is None else found.ridge
        self.weights_ = np.clip(found.weights / sizes, 0.0, 1.0)[numbers]
        self.multipliers_ = found.multipliers
        self.losses_ = problem.demo_losses(found.multipliers)
        self.objective_ = Problem(problem.rows, ridge).objective(found.multipliers, self.weights_)
        self.lower_bound_ = found.lower_bound
        self.converged_ = found.converged
        self.n_iter_ = found.n_iter
        return self

    @abstractmethod
    def solve_distinct(self, problem: Problem, sizes: Array, trusted: float) -> SolverResult:
        """Solve for K different demonstrations with `sizes` (K,) copies of each."""


def distinct_demos(problem: Problem) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return numbers (D,) of the K different demonstrations, and the first of each (K,).

    Equal demonstrations share a number; the different ones are ordered by content.
    """
    ends = np.cumsum(problem.steps_per_demo())
    states, nexts = problem.rows.states, problem.rows.nexts
    contents = [
        (nexts[stop - count : stop].tobytes(), states[stop - count : stop].tobytes())
        for stop, count in zip(ends, problem.steps_per_demo(), strict=True)
    ]
    rank = {content: number for number, content in enumerate(sorted(set(contents)))}
    numbers = np.array([rank[content] for content in contents], dtype=np.int64)
    firsts = np.unique(numbers, return_index=True)[1].astype(np.int64)
    return numbers, firsts


def fill(losses: Array, sizes: Array, trusted: float) -> Array:
    """Return the v (K,) of sum M that minimises v @ losses: the least losses are trusted first."""
    order = np.argsort(losses, kind="stable")
    before = np.cumsum(sizes[order]) - sizes[order]
    weights = np.empty_like(sizes)
    weights[order] = np.clip(trusted - before, 0.0, sizes[order])
    return weights


def concentrate(
    problem: Problem, sizes: Array, trusted: float, multipliers: Multipliers, most: int = 100
) -> tuple[Multipliers, Array, int]:
    """Alternate between the best w for lambda and the best lambda for w until w is constant.

    Each step lowers the value (a concentration step of Rousseeuw and Van Driessen 2006). It stops
    when w no longer changes, when the gain is below LEAST_GAIN, or after `most` steps.

    Returns:
        lambda, v (K,), and the number of steps.
    """
    weights = fill(problem.demo_losses(multipliers), sizes, trusted)
    value, steps = np.inf, 0
    while steps < most:
        multipliers = problem.solve(weights, multipliers)
        steps += 1
        before, value = value, problem.objective(multipliers, weights)
        update = fill(problem.demo_losses(multipliers), sizes, trusted)
        if np.array_equal(update, weights) or before - value < LEAST_GAIN or steps == most:
            break
        weights = update
    return multipliers, weights, steps


def thinned(count: int, most: int) -> NDArray[np.int64]:
    """Return at most `most` of the numbers 0..count-1, evenly spaced."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
