"""Equation 3 of the paper: weighted maximum-entropy model of the next sub-task, and its gradient.

With one block of multipliers per next sub-task, f_i(s, t) is the state in the block of t, and

    l_d(lambda) = sum_s p(s|d) log z_lambda(s) - sum_i lambda_i sum_{s,t} p(s,t|d) f_i(s,t)
    (3)  min over lambda, w of  (1/M) sum_d w_d l_d(lambda)   s.t.  sum_d w_d = M, 0 <= w_d <= 1

is demonstration d's mean negative log-likelihood per step. A ridge on lambda is added (feature
matching is relaxed): without it a separable pool lets lambda diverge and leaves w arbitrary.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_softmax

from filtering.sequence import Transitions

Multipliers = NDArray[np.float64]
"""(N, T + 1) lambda: one column per next sub-task, the last one for END."""


@dataclass(frozen=True)
class Problem:
    """The inner problem of equation 3: everything but the weights."""

    rows: Transitions
    """State and next sub-task of every step in the pool."""
    ridge: float
    """Strength of the quadratic penalty on lambda [nats per unit squared]."""

    @property
    def shape(self) -> tuple[int, int]:
        """(N, T + 1), the shape of lambda."""
        return self.rows.states.shape[1], self.rows.n_subtasks + 1

    def log_probabilities(self, multipliers: Multipliers) -> NDArray[np.float64]:
        """Return log p_lambda(t|s), (R, T + 1)."""
        result: NDArray[np.float64] = log_softmax(self.rows.states @ multipliers, axis=1)
        return result

    def step_losses(self, multipliers: Multipliers) -> NDArray[np.float64]:
        """Return -log p_lambda(t|s) of every row [nats], (R,)."""
        log_p = self.log_probabilities(multipliers)
        return -log_p[np.arange(len(log_p)), self.rows.nexts]

    def demo_losses(self, multipliers: Multipliers) -> NDArray[np.float64]:
        """Return l_d [nats per step], (D,)."""
        counts = self.steps_per_demo()
        sums = np.bincount(
            self.rows.demos, self.step_losses(multipliers), minlength=self.rows.n_demos
        )
        return sums / counts

    def steps_per_demo(self) -> NDArray[np.int64]:
        """Return the number of rows of each demonstration, (D,)."""
        return np.bincount(self.rows.demos, minlength=self.rows.n_demos)

    def objective(self, multipliers: Multipliers, weights: NDArray[np.float64]) -> float:
        """Return the value of equation 3 with the ridge, for weights (D,) of any positive sum."""
        data = weights @ self.demo_losses(multipliers) / weights.sum()
        return float(data + 0.5 * self.ridge * np.sum(multipliers**2))

    def gradient(self, multipliers: Multipliers, weights: NDArray[np.float64]) -> Multipliers:
        """Return d objective / d lambda, (N, T + 1)."""
        residuals = np.exp(self.log_probabilities(multipliers))
        residuals[np.arange(len(residuals)), self.rows.nexts] -= 1.0
        residuals *= self.row_weights(weights)[:, None]
        slope: Multipliers = self.rows.states.T @ residuals + self.ridge * multipliers
        return slope

    def row_weights(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return w_d p(s,t|d) / sum w for every row, (R,); they sum to 1."""
        per_demo = weights / (weights.sum() * self.steps_per_demo())
        return per_demo[self.rows.demos]

    def solve(self, weights: NDArray[np.float64], start: Multipliers | None = None) -> Multipliers:
        """Return the lambda that minimises the objective for fixed weights (strictly convex)."""
        shape = self.shape

        def value_and_slope(flat: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
            multipliers = flat.reshape(shape)
            return (
                self.objective(multipliers, weights),
                self.gradient(multipliers, weights).ravel(),
            )

        first = np.zeros(shape) if start is None else start
        found = minimize(
            value_and_slope,
            first.ravel(),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": 2000, "ftol": 1e-11, "gtol": 1e-6},
        )
        result: Multipliers = found.x.reshape(shape)
        return result
