"""Equation 3 as the paper's predecessors solved it: sequential quadratic programming.

SLSQP of SciPy over (lambda, w) from lambda = 0 and uniform weights, without a ridge. In a separable
pool lambda then grows without bound; the solver stops at its tolerance or its last iteration, so
the result is finite but depends on where it stopped. Kept for comparison with the paper.
"""

import numpy as np
from scipy.optimize import minimize

from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.solver import Solver, SolverResult
from teasim.common.arrays import Array

ITERATIONS = 100
"""Largest number of iterations, the default of SciPy."""
TOLERANCE = 1e-6
"""Change of the value at which it stops, the default of SciPy [nats per step]."""


class Published(Solver):
    """Solves equation 3 with SLSQP."""

    def __init__(self, ridge: float = 0.0) -> None:
        """Keep the strength of the ridge penalty on lambda; the paper has none."""
        self.ridge = ridge

    def solve_distinct(self, problem: Problem, sizes: Array, trusted: float) -> SolverResult:
        """Solve for K different demonstrations with `sizes` (K,) copies of each."""
        problem = Problem(problem.rows, self.ridge)
        shape = problem.shape
        split = shape[0] * shape[1]

        def value_and_slope(point: Array) -> tuple[float, Array]:
            multipliers, weights = point[:split].reshape(shape), point[split:]
            # Where sum w differs from M, the mean over M is this factor times the weighted mean.
            scale = float(weights.sum()) / trusted
            value, slope = problem.value_and_slope(multipliers, weights)
            penalty = 0.5 * self.ridge * float(np.sum(multipliers**2))
            slope = scale * (slope - self.ridge * multipliers) + self.ridge * multipliers
            losses = problem.demo_losses(multipliers) / trusted
            return scale * (value - penalty) + penalty, np.concatenate([slope.ravel(), losses])

        ones = np.concatenate([np.zeros(split), np.ones(len(sizes))])
        found = minimize(
            value_and_slope,
            np.concatenate([np.zeros(split), sizes * trusted / sizes.sum()]),
            jac=True,
            method="SLSQP",
            bounds=[(None, None)] * split + [(0.0, size) for size in sizes],
            constraints={
                "type": "eq",
                "fun": lambda point: point[split:].sum() - trusted,
                "jac": lambda point: ones,  # noqa: ARG005
            },
            options={"maxiter": ITERATIONS, "ftol": TOLERANCE},
        )
        weights = np.clip(found.x[split:], 0.0, sizes)
        return SolverResult(
            found.x[:split].reshape(shape),
            weights * trusted / weights.sum(),
            bool(found.success),
            int(found.nit),
            ridge=self.ridge,
        )
