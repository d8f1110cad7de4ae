"""Equation 3 with a certificate: branch and bound over who is trusted, for about 20 demonstrations.

Let H(v) = min over lambda of sum_k v_k (l_k(lambda) + ridge/2 |lambda|^2), so that equation 3 is
min H(v) / M. As a minimum of linear functions H is concave: its least over {0 <= v <= sizes,
sum v = M} is at a corner, where all demonstrations but one are trusted fully or not at all. It is
also H(c v) = c H(v), so H(v + u) >= H(v) + H(u).

A node of the tree trusts some demonstrations (v), leaves some out, and has to spend the rest r of M
on the free ones. With u_k = H(v + r e_k) / r, concavity gives for every such way of spending

    H(v + sum_k x_k e_k)  >=  sum_k (x_k / r) H(v + r e_k)  =  sum_k x_k u_k,

whose least is found by taking the cheapest first: a lower bound on the whole branch.
"""

from dataclasses import dataclass

import numpy as np

from filtering.judging.equation3.annealed import Annealed
from filtering.judging.equation3.problem import Multipliers, Problem
from filtering.judging.equation3.solver import Array, Solution, Solver, fill
from teasim.common.errors import ConfigError

MOST = 24
"""Most different demonstrations; each one more may double the work."""
TOLERANCE = 1e-6
"""How much the value may lie above the lower bound, if nothing else is asked [nats per step]."""
PRECISION = 1e-3
"""How precisely lambda is solved for, as a share of the tolerance; the bound allows for it."""
NOTHING = 1e-9
"""Weights below this are the dust of floating-point sums."""


class Exact(Solver):
    """Solves equation 3 for good; `lower_bound_` says how well."""

    def __init__(self, tolerance: float = TOLERANCE) -> None:
        """Take how much the value may lie above the lower bound [nats per step]."""
        self.tolerance = tolerance

    def solve_kinds(self, problem: Problem, sizes: Array, trusted: float) -> Solution:
        """Solve for K different demonstrations, `sizes` (K,) of each."""
        if len(sizes) > MOST:
            raise ConfigError(
                f"The pool has {len(sizes)} different demonstrations, and the solver 'exact' takes "
                f"{MOST} at most; choose another solver."
            )
        return _Search(problem, sizes, trusted, self.tolerance).run()


@dataclass(frozen=True)
class _Node:
    """A branch: who is trusted is decided for some, open for the rest."""

    trusted: Array
    """(K,) how much is trusted already, 0 for open ones."""
    open: tuple[int, ...]
    """Not decided yet, the likeliest first."""
    partial: int | None
    """The one that may be trusted in part."""
    costs: Array
    """(K,) u_k; inf where k may not be trusted."""
    start: Multipliers
    """lambda of a solution nearby."""


class _Search:
    """One search; the best solution so far is kept."""

    def __init__(self, problem: Problem, sizes: Array, trusted: float, tolerance: float) -> None:
        self.problem, self.sizes, self.total = problem, sizes, trusted
        self.tolerance = tolerance
        found = Annealed().solve_kinds(problem, sizes, trusted)
        self.solved = found.n_iter
        self.multipliers, self.weights = found.multipliers, found.weights
        self.best, self.bound = self._value(found.weights, found.multipliers)[:2]
        # Parts arise only where equal demonstrations, or a fraction of one, have to be shared out.
        self.divisible = sizes > (1.0 if trusted.is_integer() else 0.0)

    def run(self) -> Solution:
        likely = np.argsort(self.problem.demo_losses(self.multipliers), kind="stable")
        self._visit(np.zeros(len(self.sizes)), tuple(likely.tolist()), None, self.multipliers)
        bound = self.bound / self.total
        return Solution(self.multipliers, self.weights, True, self.solved, bound)

    def _visit(
        self, trusted: Array, still_open: tuple[int, ...], partial: int | None, start: Multipliers
    ) -> None:
        """Search a branch, if it can hold anything better."""
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
        """Decide one after the other: trusted, trusted in part, or, going on, left out."""
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
        """Tell that spending `rest`, after `first` was trusted, leads to nothing better."""
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
        """Look at a corner."""
        value, bound, multipliers = self._value(weights, start)
        self.bound = min(self.bound, bound)
        if value < self.best:
            self.best, self.multipliers, self.weights = value, multipliers, weights

    def _value(self, weights: Array, start: Multipliers) -> tuple[float, float, Multipliers]:
        """Return H(v), a number that it is not below, and lambda."""
        self.solved += 1
        multipliers = self.problem.solve(weights, start, PRECISION * self.tolerance)
        value, slope = self.problem.value_and_slope(multipliers, weights)
        # A function whose curvature is at least the ridge is nowhere lower than this.
        least = value - float(np.sum(slope**2)) / (2 * self.problem.ridge)
        return value * weights.sum(), least * weights.sum(), multipliers


def _with(weights: Array, which: int, amount: float) -> Array:
    more = weights.copy()
    more[which] += amount
    return more
