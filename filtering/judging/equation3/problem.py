"""Equation 3 of the paper: a weighted maximum-entropy model of the next sub-task.

With one block of multipliers per next sub-task, f_i(s, t) is the state in the block of t, and

    l_d(lambda) = sum_s p(s|d) log z_lambda(s) - sum_i lambda_i sum_{s,t} p(s,t|d) f_i(s,t)
    (3)  min over lambda, w of  (1/M) sum_d w_d l_d(lambda)   s.t.  sum_d w_d = M, 0 <= w_d <= 1

is the mean negative log-likelihood per step of demonstration d. A ridge on lambda is added, which
relaxes feature matching: without it lambda diverges in a separable pool and w is arbitrary.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from filtering.judging.equation3.sequence import Transitions

Multipliers = NDArray[np.float64]
"""(N, T + 1) lambda: one column per next sub-task, the last one for END."""

MOST_FOR_NEWTON = 200
"""Number of multipliers up to which Newton's method is faster than L-BFGS."""
NEWTON_STEPS = 100
"""Largest number of Newton steps."""
SHORTEST_STEP = 1e-6
"""Share of a Newton step down to which it is halved."""


@dataclass(frozen=True)
class Problem:
    """The inner problem of equation 3: all but the weights."""

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
        # Labels first: sums over a few labels are fast along the first axis only.
        scores = multipliers.T @ self.rows.states.T
        scores -= scores.max(axis=0)
        scores -= np.log(np.exp(scores).sum(axis=0))
        return np.asarray(scores.T)

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
        return self.value_and_slope(multipliers, weights)[0]

    def gradient(self, multipliers: Multipliers, weights: NDArray[np.float64]) -> Multipliers:
        """Return d objective / d lambda, (N, T + 1)."""
        return self.value_and_slope(multipliers, weights)[1]

    def value_and_slope(
        self, multipliers: Multipliers, weights: NDArray[np.float64]
    ) -> tuple[float, Multipliers]:
        """Return the objective and its gradient (N, T + 1)."""
        shares = self.row_weights(weights)
        everyone = np.arange(len(shares))
        log_p = self.log_probabilities(multipliers)
        data = -float(shares @ log_p[everyone, self.rows.nexts])
        residuals = np.exp(log_p, out=log_p)
        residuals[everyone, self.rows.nexts] -= 1.0
        residuals *= shares[:, None]
        slope: Multipliers = self.rows.states.T @ residuals + self.ridge * multipliers
        return data + 0.5 * self.ridge * float(np.sum(multipliers**2)), slope

    def curvature(
        self, multipliers: Multipliers, weights: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return d^2 objective / d lambda^2, (N (T + 1), N (T + 1)), for lambda.ravel()."""
        states, shares = self.rows.states, self.row_weights(weights)
        p = np.exp(self.log_probabilities(multipliers))
        size, labels = self.shape
        crossed = (states[:, :, None] * (np.sqrt(shares)[:, None] * p)[:, None, :]).reshape(
            len(states), -1
        )
        matrix: NDArray[np.float64] = -crossed.T @ crossed
        blocks = matrix.reshape(size, labels, size, labels)
        for label in range(labels):
            blocks[:, label, :, label] += states.T @ ((shares * p[:, label])[:, None] * states)
        matrix[np.diag_indices_from(matrix)] += self.ridge
        return matrix

    def row_weights(self, weights: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return w_d p(s,t|d) / sum w for every row, (R,); they sum to 1."""
        per_demo = weights / (weights.sum() * self.steps_per_demo())
        return np.asarray(per_demo[self.rows.demos])

    def solve(
        self,
        weights: NDArray[np.float64],
        start: Multipliers | None = None,
        precision: float = 1e-11,
    ) -> Multipliers:
        """Return the lambda that minimises the objective for fixed weights (strictly convex).

        Args:
            weights: (D,) of any positive sum.
            start: first lambda; None means zeros.
            precision: relative improvement of the objective at which it stops.
        """
        shape = self.shape
        # Rows of demonstrations without weight change nothing and need no look.
        problem = self.only(weights > 0) if (weights == 0).any() else self
        kept = weights[weights > 0]

        def value_and_slope(flat: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
            value, slope = problem.value_and_slope(flat.reshape(shape), kept)
            return value, slope.ravel()

        first = np.zeros(shape) if start is None else start
        if first.size <= MOST_FOR_NEWTON and self.ridge > 0:
            return problem._newton(first, kept, precision)
        found = minimize(
            value_and_slope,
            first.ravel(),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": 2000, "ftol": precision, "gtol": 1e-6},
        )
        result: Multipliers = found.x.reshape(shape)
        return result

    def _newton(
        self, multipliers: Multipliers, weights: NDArray[np.float64], precision: float
    ) -> Multipliers:
        """Take Newton steps, each halved until it improves the value enough (Armijo)."""
        value, slope = self.value_and_slope(multipliers, weights)
        for _ in range(NEWTON_STEPS):
            step = cho_solve(cho_factor(self.curvature(multipliers, weights)), slope.ravel())
            promised = 0.5 * float(slope.ravel() @ step)
            if promised <= precision * max(1.0, value):
                break
            length = 1.0
            while length > SHORTEST_STEP:
                there = multipliers - length * step.reshape(self.shape)
                new_value, new_slope = self.value_and_slope(there, weights)
                if new_value <= value - 0.2 * length * promised:
                    break
                length /= 2
            multipliers, value, slope = there, new_value, new_slope
        return multipliers

    def only(self, demos: NDArray[np.bool_] | NDArray[np.int64]) -> "Problem":
        """Return the problem of some demonstrations, given by a mask (D,) or by ordered numbers."""
        numbers = np.flatnonzero(demos) if demos.dtype == bool else demos
        counts = self.steps_per_demo()
        starts = np.cumsum(counts) - counts
        sizes = counts[numbers]
        ends = np.cumsum(sizes)
        rows = np.repeat(starts[numbers] - (ends - sizes), sizes) + np.arange(sizes.sum())
        return Problem(
            Transitions(
                states=self.rows.states[rows],
                nexts=self.rows.nexts[rows],
                demos=np.repeat(np.arange(len(numbers)), sizes),
                n_demos=len(numbers),
                n_subtasks=self.rows.n_subtasks,
            ),
            self.ridge,
        )
