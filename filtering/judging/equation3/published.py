"""Equation 3 as the paper's predecessors solved it: sequential quadratic programming.

SciPy's SLSQP over (lambda, w) from lambda = 0 and uniform weights, without a ridge. Without one a
separable pool lets lambda grow without end; the solver then stops at its tolerance or its last
iteration, so what it returns is finite but depends on where it stopped. For fidelity, and as a
baseline.
"""

import numpy as np
from scipy.optimize import minimize

from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.solver import Array, Solution, Solver

ITERATIONS = 100
"""Most iterations, SciPy's default."""
TOLERANCE = 1e-6
"""Change of the value at which it stops, SciPy's default [nats per step]."""


class Published(Solver):
    """Solves equation 3 with SLSQP."""

    def __init__(self, ridge: float = 0.0) -> None:
        """Take the strength of the penalty on lambda; the paper has none."""
        self.ridge = ridge

    def solve_kinds(self, problem: Problem, sizes: Array, trusted: float) -> Solution:
        """Solve for K different demonstrations, `sizes` (K,) of each."""
        problem = Problem(problem.rows, self.ridge)
        shape = problem.shape
        split = shape[0] * shape[1]

        def value_and_slope(point: Array) -> tuple[float, Array]:
            multipliers, weights = point[:split].reshape(shape), point[split:]
            # Away from sum w = M the mean over M differs from the weighted mean by this factor.
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
        return Solution(
            found.x[:split].reshape(shape),
            weights * trusted / weights.sum(),
            bool(found.success),
            int(found.nit),
            ridge=self.ridge,
        )
