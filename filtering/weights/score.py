"""How surprising each demonstration is to a model fitted without it.

The weights of equation 3 always trust exactly M demonstrations, also in a clean pool, so they rank
but do not decide. Each demonstration is therefore scored by surprises of two kinds, in nats:

* step: log max_u p(u|s) - log p(t|s), how much less likely the step taken was than the likeliest
  one, under equation 3 fitted to the others. 0 wherever the demonstration does the usual thing,
  however long it is.
* omission (not part of equation 3): max(0, log-odds that the others do the sub-task), for each
  sub-task the demonstration never does. A conditional next-step model may find a left-out step
  unsurprising where many orders are usual; counting who does it at all does not.

Of each kind the worst surprise counts in full, the next by half, and so on: one defect is never
averaged away over the steps that went well. The sum of both kinds is the loss l_d, and

    w_d = exp(-max(0, l_d - median l) / unit)

the weight: 1 for whatever is no stranger than half of the pool. The unit is 1 nat, or more where
the better half of the pool itself varies more (many legal orders). Because head count decides what
is usual, at least half of the pool must be consistent.

All this is done twice: first with the weights of equation 3, then with the w_d above, so that all
consistent demonstrations shape the final model and not only the M trusted ones.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.weights.problem import Multipliers, Problem
from filtering.weights.solvers import Solution

DECAY = 0.5
"""Share that each further surprise of a demonstration counts of the one before it."""
SMALLEST_UNIT = 1.0
"""Loss above the median that takes a weight from 1 to 1/e in a pool without variety [nats]."""
SPREADS_PER_UNIT = 2.0
"""The same in a pool with variety [mean distance of the better half below the median]."""
SMOOTHING = 0.5
"""Pseudo-count on both sides of the omission log-odds [demonstrations]."""


@dataclass(frozen=True)
class Score:
    """Surprises of a pool; rows are those of the problem's `Transitions`."""

    step: NDArray[np.float64]
    """(R,) surprise of each step [nats]."""
    log_probabilities: NDArray[np.float64]
    """(R, T + 1) log p(t|s) of each row under the model without its demonstration; T is END."""
    omission: NDArray[np.float64]
    """(D, T) surprise of each sub-task that a demonstration never does, else 0 [nats]."""
    losses: NDArray[np.float64]
    """(D,) l_d [nats], higher is worse."""

    @property
    def weights(self) -> NDArray[np.float64]:
        """(D,) w_d in (0, 1]: 1 for a usual demonstration, towards 0 for a strange one."""
        return graded(self.losses)


def score(problem: Problem, solution: Solution) -> Score:
    """Return the leave-one-out score, reweighted once."""
    first = _score_once(problem, solution.weights, solution.multipliers)
    multipliers = problem.solve(first.weights, solution.multipliers)
    return _score_once(problem, first.weights, multipliers)


def _score_once(problem: Problem, weights: NDArray[np.float64], multipliers: Multipliers) -> Score:
    log_p = leave_one_out(problem, weights, multipliers)
    step = log_p.max(axis=1) - log_p[np.arange(len(log_p)), problem.rows.nexts]
    omission = omission_surprises(problem, weights)
    demos = problem.rows.demos
    losses = [
        worst_first(step[demos == demo]) + worst_first(omission[demo])
        for demo in range(problem.rows.n_demos)
    ]
    return Score(step, log_p, omission, np.array(losses))


def leave_one_out(
    problem: Problem, weights: NDArray[np.float64], multipliers: Multipliers
) -> NDArray[np.float64]:
    """Return log p(t|s) of every row under equation 3 fitted to the other demonstrations.

    Args:
        problem: the pool's rows.
        weights: (D,) how much each demonstration counts in the others' models.
        multipliers: lambda fitted with all of them, where each refit starts.

    Returns:
        (R, T + 1) natural logarithms.
    """
    rows = problem.rows
    log_p = np.zeros((len(rows.demos), rows.n_subtasks + 1))
    for demo in range(rows.n_demos):
        others = _without(weights, demo)
        mine = rows.demos == demo
        log_p[mine] = problem.log_probabilities(problem.solve(others, multipliers))[mine]
    return log_p


def omission_surprises(problem: Problem, weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (D, T): log-odds that the others do a sub-task this demonstration never does."""
    rows = problem.rows
    occurs = np.zeros((rows.n_demos, rows.n_subtasks + 1))
    occurs[rows.demos, rows.nexts] = 1.0
    occurs = occurs[:, :-1]
    doing = weights @ occurs - weights[:, None] * occurs + SMOOTHING
    lacking = weights @ (1 - occurs) - weights[:, None] * (1 - occurs) + SMOOTHING
    surprises: NDArray[np.float64] = (1 - occurs) * np.maximum(0.0, np.log(doing / lacking))
    return surprises


def graded(losses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return w_d = exp(-max(0, l_d - median) / unit) for losses (D,) in nats."""
    median = np.median(losses)
    spread = median - losses[losses <= median].mean()
    unit = max(SMALLEST_UNIT, SPREADS_PER_UNIT * spread)
    weights: NDArray[np.float64] = np.exp(-np.maximum(0.0, losses - median) / unit)
    return weights


def worst_first(surprises: NDArray[np.float64]) -> float:
    """Return the sum of the surprises in falling order, each counted DECAY of the one before."""
    ordered = np.sort(surprises)[::-1]
    return float(ordered @ DECAY ** np.arange(len(ordered)))


def _without(weights: NDArray[np.float64], demo: int) -> NDArray[np.float64]:
    others = weights.copy()
    others[demo] = 0.0
    # A pool in which nobody else is trusted has no opinion: every other demonstration counts alike.
    if others.sum() < 1e-9:
        others = np.where(np.arange(len(weights)) == demo, 0.0, 1.0)
    return others
