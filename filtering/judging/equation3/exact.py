"""Equation 3 with a certificate: branch and bound, for about 20 demonstrations.

Let H(v) = min over lambda of sum_k v_k (l_k(lambda) + ridge/2 |lambda|^2), so that equation 3 is
min H(v) / M. As a minimum of linear functions H is concave: its minimum over {0 <= v <= sizes,
sum v = M} is at a corner, where all demonstrations but one are trusted fully or not at all. Also
H(c v) = c H(v), so H(v + u) >= H(v) + H(u).

A node of the tree trusts some demonstrations (v), excludes some, and has to distribute the rest r
of M among the open ones. With u_k = H(v + r e_k) / r, concavity gives for every distribution x

    H(v + sum_k x_k e_k)  >=  sum_k (x_k / r) H(v + r e_k)  =  sum_k x_k u_k,

whose minimum is found by taking the smallest u_k first: a lower bound on the whole branch.
"""

from dataclasses import dataclass

import numpy as np

from filtering.judging.equation3.annealed import Annealed
from filtering.judging.equation3.problem import Multipliers, Problem
from filtering.judging.equation3.solver import Solver, SolverResult, fill
from teasim.common.arrays import Array
from teasim.common.errors import ConfigError

MOST = 24
"""Largest number of different demonstrations; each further one may double the work."""
TOLERANCE = 1e-6
"""Default of the largest gap between the value and the lower bound [nats per step]."""
PRECISION = 1e-3
"""Precision of lambda as a share of the tolerance; the bound allows for it."""
NOTHING = 1e-9
"""Weights below this are rounding errors."""


class Exact(Solver):
    """Solves equation 3 globally; `lower_bound_` certifies the value."""

    def __init__(self, tolerance: float = TOLERANCE) -> None:
        """Keep the largest gap between the value and the lower bound [nats per step]."""
        self.tolerance = tolerance

    def solve_distinct(self, problem: Problem, sizes: Array, trusted: float) -> SolverResult:
        """Solve for K different demonstrations with `sizes` (K,) copies of each."""
        if len(sizes) > MOST:
            raise ConfigError(
                f"The pool has {len(sizes)} different demonstrations, and the solver 'exact' takes "
                f"{MOST} at most; choose another solver."
            )
        return _Search(problem, sizes, trusted, self.tolerance).run()


@dataclass(frozen=True)
class _Node:
    """A branch: some demonstrations are decided, the others are open."""

    trusted: Array
    """(K,) trust already assigned, 0 for open ones."""
    open: tuple[int, ...]
    """Open demonstrations, those of least loss first."""
    partial: int | None
    """The demonstration that may be trusted in part; None if it is not chosen yet."""
    costs: Array
    """(K,) u_k, inf where k may not be trusted."""
    start: Multipliers
    """lambda of a nearby solution."""


class _Search:
    """One search; keeps the best solution so far."""

    def __init__(self, problem: Problem, sizes: Array, trusted: float, tolerance: float) -> None:
        self.problem, self.sizes, self.total = problem, sizes, trusted
        self.tolerance = tolerance
        found = Annealed().solve_distinct(problem, sizes, trusted)
        self.solved = found.n_iter
        self.multipliers, self.weights = found.multipliers, found.weights
        self.best, self.bound = self._value(found.weights, found.multipliers)[:2]
        # Partial trust occurs only for groups of equal demonstrations, or when M is not whole.
        self.divisible = sizes > (1.0 if trusted.is_integer() else 0.0)

    def run(self) -> SolverResult:
        likely = np.argsort(self.problem.demo_losses(self.multipliers), kind="stable")
        self._visit(np.zeros(len(self.sizes)), tuple(likely.tolist()), None, self.multipliers)
        bound = self.bound / self.total
        return SolverResult(self.multipliers, self.weights, True, self.solved, bound)

    def _visit(
        self, trusted: Array, still_open: tuple[int, ...], partial: int | None, start: Multipliers
    ) -> None:
        """Search a branch if it can contain a better solution."""
        rest = self.total - trusted.sum()
        if rest <= NOTHING:
            if partial is None:
                self._compare(trusted, start)
            return
        candidates = list(still_open) if partial is None else [partial, *still_open]
        if self.sizes[candidates].sum() < rest - NOTHING:
            return
        if not still_open:
            self._compare(_with(trusted, candidates[0], rest), start)
            return
        costs = np.full(len(self.sizes), np.inf)
        for k in candidates:
            _, bound, nearby = self._value(_with(trusted, k, rest), start)
            costs[k] = bound / rest
        self._expand(_Node(trusted, still_open, partial, costs, nearby))

    def _expand(self, node: _Node) -> None:
        """Decide open ones in turn: trusted, trusted in part, or else excluded."""
        still_open, rest = node.open, self.total - node.trusted.sum()
        while still_open and not self._hopeless(node, still_open, rest, None):
            first, still_open = still_open[0], still_open[1:]
            if self.sizes[first] <= rest + NOTHING and not self._hopeless(
                node, still_open, rest - self.sizes[first], first
            ):
                more = _with(node.trusted, first, self.sizes[first])
                self._visit(more, still_open, node.partial, node.start)
            if node.partial is None and self.divisible[first]:
                self._visit(node.trusted, still_open, first, node.start)
        if not still_open and node.partial is not None:
            self._visit(node.trusted, (), node.partial, node.start)

    def _hopeless(
        self, node: _Node, still_open: tuple[int, ...], rest: float, first: int | None
    ) -> bool:
        """Return whether distributing `rest`, with `first` trusted, cannot improve the value."""
        candidates = list(still_open) if node.partial is None else [node.partial, *still_open]
        if self.sizes[candidates].sum() < rest - NOTHING:
            return True
        costs = node.costs[candidates]
        bound = float(fill(costs, self.sizes[candidates], rest) @ costs)
        if first is not None:
            bound += float(self.sizes[first] * node.costs[first])
        if bound < self.best - self.tolerance * self.total:
            return False
        self.bound = min(self.bound, bound)
        return True

    def _compare(self, weights: Array, start: Multipliers) -> None:
        """Evaluate a corner and keep it if it is the best one."""
        value, bound, multipliers = self._value(weights, start)
        self.bound = min(self.bound, bound)
        if value < self.best:
            self.best, self.multipliers, self.weights = value, multipliers, weights

    def _value(self, weights: Array, start: Multipliers) -> tuple[float, float, Multipliers]:
        """Return H(v), a lower bound on it, and lambda."""
        self.solved += 1
        multipliers = self.problem.solve(weights, start, PRECISION * self.tolerance)
        value, slope = self.problem.value_and_slope(multipliers, weights)
        # A lower bound for a function whose curvature is at least the ridge.
        least = value - float(np.sum(slope**2)) / (2 * self.problem.ridge)
        return value * weights.sum(), least * weights.sum(), multipliers


def _with(weights: Array, which: int, amount: float) -> Array:
    more = weights.copy()
    more[which] += amount
    return more
