"""What every solver of equation 3 over (lambda, w) has in common.

Demonstrations that are equal in every row are one demonstration that may weigh as much as they
are: the value of equation 3 depends on their sum alone. So a solver is given the different ones, in
an order of content, and how many there are of each. Two laws follow for all solvers, to the last
bit: equal demonstrations get equal weights, and permuting demonstrations permutes the weights.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from filtering.judging.equation3.problem import Multipliers, Problem
from teasim.common.errors import ConfigError

Array = NDArray[np.float64]

LEAST_GAIN = 1e-7
"""Progress below this is none [nats per step]."""


@dataclass(frozen=True)
class Solution:
    """A solution over K different demonstrations."""

    multipliers: Multipliers
    """(N, T + 1) lambda."""
    weights: Array
    """(K,) v in [0, number of equal ones], sum v = M."""
    converged: bool
    """Whether the solver ended because it was done."""
    n_iter: int
    """How often lambda was solved for."""
    lower_bound: float = -np.inf
    """No solution has a lower value than this [nats per step]."""
    ridge: float | None = None
    """Strength of the penalty that was solved with, if not the problem's."""


class Solver(ABC):
    """Solves min over lambda, w of equation 3 with sum w = M, 0 <= w <= 1.

    After `fit`:
        weights_ (D,): w in [0, 1], sum M.
        multipliers_ (N, T + 1): lambda.
        losses_ (D,): l_d [nats per step].
        objective_: value of equation 3 with the ridge that was solved with [nats per step].
        lower_bound_: no solution has a lower value; -inf where the solver cannot say.
        converged_: whether the solver ended because it was done.
        n_iter_: how often lambda was solved for.
    """

    weights_: Array
    multipliers_: Multipliers
    losses_: Array
    objective_: float
    lower_bound_: float
    converged_: bool
    n_iter_: int

    def fit(self, problem: Problem, trusted: float) -> Self:
        """Solve the problem, which is not modified.

        Args:
            problem: states and next sub-tasks of D demonstrations.
            trusted: M, how many demonstrations are trusted, 0 < M < D; it need not be whole.

        Raises:
            ConfigError: M is out of range, or the problem is too large for the solver.
        """
        if not 0 < trusted < problem.rows.n_demos:
            raise ConfigError(
                f"{trusted} trusted demonstrations were asked for; choose a number between 0 and "
                f"{problem.rows.n_demos}."
            )
        kinds, firsts = kinds_of(problem)
        sizes = np.bincount(kinds).astype(np.float64)
        found = self.solve_kinds(problem.only(firsts), sizes, float(trusted))
        ridge = problem.ridge if found.ridge is None else found.ridge
        self.weights_ = np.clip(found.weights / sizes, 0.0, 1.0)[kinds]
        self.multipliers_ = found.multipliers
        self.losses_ = problem.demo_losses(found.multipliers)
        self.objective_ = Problem(problem.rows, ridge).objective(found.multipliers, self.weights_)
        self.lower_bound_ = found.lower_bound
        self.converged_ = found.converged
        self.n_iter_ = found.n_iter
        return self

    @abstractmethod
    def solve_kinds(self, problem: Problem, sizes: Array, trusted: float) -> Solution:
        """Solve for K different demonstrations, `sizes` (K,) of each."""


def kinds_of(problem: Problem) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return (D,) the kind of each demonstration, (K,) the first demonstration of each kind.

    Equal demonstrations are of one kind; kinds are numbered by content.
    """
    ends = np.cumsum(problem.steps_per_demo())
    states, nexts = problem.rows.states, problem.rows.nexts
    contents = [
        (nexts[stop - count : stop].tobytes(), states[stop - count : stop].tobytes())
        for stop, count in zip(ends, problem.steps_per_demo(), strict=True)
    ]
    number = {content: kind for kind, content in enumerate(sorted(set(contents)))}
    kinds = np.array([number[content] for content in contents], dtype=np.int64)
    firsts = np.unique(kinds, return_index=True)[1].astype(np.int64)
    return kinds, firsts


def fill(losses: Array, sizes: Array, trusted: float) -> Array:
    """Return the v (K,) that minimises v @ losses: the least losses are trusted first."""
    order = np.argsort(losses, kind="stable")
    before = np.cumsum(sizes[order]) - sizes[order]
    weights = np.empty_like(sizes)
    weights[order] = np.clip(trusted - before, 0.0, sizes[order])
    return weights


def concentrate(
    problem: Problem, sizes: Array, trusted: float, multipliers: Multipliers, most: int = 100
) -> tuple[Multipliers, Array, int]:
    """Alternate between the best w for lambda and the best lambda for w until w stands still.

    Each step lowers the value (Rousseeuw and Van Driessen 2006 call it concentration), so it ends:
    with the last change of w, or with a gain below LEAST_GAIN.

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
    """Return at most `most` of the numbers 0..count-1, evenly spread."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))
