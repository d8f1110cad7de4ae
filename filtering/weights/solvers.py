"""Solvers of equation 3 over (lambda, w).

`annealed` adds the entropy term tau * sum_d [w log w + (1 - w) log(1 - w)]. For fixed lambda the
optimal weights are then w_d = sigmoid((nu - l_d) / tau) with nu from sum w = M. tau goes from large
(all demonstrations count alike) to small (the M most consistent ones count): one smooth path that
starts at the whole pool's majority, where the plain problem has many local optima.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import expit

from filtering.weights.problem import Multipliers, Problem
from teasim.errors import ConfigError

TAU_FIRST = 1.0
"""First temperature [nats per step]: well above the spread of the losses, w is nearly uniform."""
TAU_LAST = 0.02
"""Last temperature [nats per step]: well below what one defect adds to a demonstration's mean."""
TAU_COUNT = 16
"""Number of temperatures, geometrically spaced."""
INNER_STEPS = 20
"""Most alternations between lambda and w at one temperature."""
WEIGHT_TOLERANCE = 1e-4
"""Largest change of a weight at which a temperature counts as solved."""


@dataclass(frozen=True)
class Solution:
    """A solution of equation 3."""

    multipliers: Multipliers
    """(N, T + 1) lambda."""
    weights: NDArray[np.float64]
    """(D,) w in [0, 1], sum w = M."""
    objective: float
    """Value of equation 3 with the ridge, without the entropy term [nats per step]."""


Solver = Callable[[Problem, float], Solution]
"""Takes the problem and M, the number of trusted demonstrations."""


def trust(losses: NDArray[np.float64], trusted: float, tau: float) -> NDArray[np.float64]:
    """Return w_d = sigmoid((nu - l_d) / tau), with nu such that sum w = M = `trusted`; (D,)."""
    reach = tau * (np.log(len(losses)) + 40.0)

    def excess(nu: float) -> float:
        return float(expit((nu - losses) / tau).sum() - trusted)

    nu = brentq(excess, losses.min() - reach, losses.max() + reach, xtol=1e-14)
    weights: NDArray[np.float64] = expit((nu - losses) / tau)
    return weights


def annealed(problem: Problem, trusted: float) -> Solution:
    """Solve equation 3 along one path of falling temperature."""
    weights = np.full(problem.rows.n_demos, trusted / problem.rows.n_demos)
    multipliers = problem.solve(weights)
    for tau in np.geomspace(TAU_FIRST, TAU_LAST, TAU_COUNT):
        multipliers, weights = _settle(problem, trusted, float(tau), multipliers, weights)
    return Solution(multipliers, weights, problem.objective(multipliers, weights))


def _settle(
    problem: Problem,
    trusted: float,
    tau: float,
    multipliers: Multipliers,
    weights: NDArray[np.float64],
) -> tuple[Multipliers, NDArray[np.float64]]:
    """Alternate between w and lambda at one temperature until w stands still."""
    for _ in range(INNER_STEPS):
        update = trust(problem.demo_losses(multipliers), trusted, tau)
        change = np.abs(update - weights).max()
        weights = update
        multipliers = problem.solve(weights, multipliers)
        if change < WEIGHT_TOLERANCE:
            break
    return multipliers, weights


SOLVERS: dict[str, Solver] = {"annealed": annealed}


def solver_named(name: str) -> Solver:
    """Return a solver.

    Raises:
        ConfigError: there is no solver of that name.
    """
    if name not in SOLVERS:
        raise ConfigError(f"Unknown solver '{name}'; choose {', '.join(SOLVERS)}.")
    return SOLVERS[name]
