"""Surprise of each demonstration under a model fitted without it.

The weights of equation 3 always trust exactly M demonstrations, even in a clean pool, so they rank
demonstrations but do not separate them. Each demonstration is therefore scored by surprises of two
types, in nats:

* step: log max_u p(u|s) - log p(t|s), how much less likely the step taken was than the likeliest
  one, under equation 3 fitted to the other demonstrations. It is 0 for usual steps, at any length.
* omission (not part of equation 3): max(0, log-odds that the others do the sub-task), for each
  sub-task the demonstration lacks. A conditional next-step model may not be surprised by an
  omission where many orders are usual; the frequency of the sub-task shows it.

Of each type the largest surprise counts in full, the next one by half, and so on: one mistake is
not averaged away over the correct steps. The sum of both types is the loss l_d, and

    w_d = exp(-max(0, l_d - median l) / unit)

is the weight: 1 for demonstrations no more surprising than the median. The unit is 1 nat, or more
where the better half of the pool varies more (many legal orders). Because the majority defines what
is usual, at least half of the pool must be consistent.

This is done twice: first with the weights of equation 3, then with the w_d above, so that all
consistent demonstrations shape the final model and not only the M trusted ones.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.special import log_softmax

from filtering.judging.equation3.problem import Multipliers, Problem
from filtering.judging.equation3.solver import Solver, distinct_demos, thinned

DECAY = 0.5
"""Factor of each further surprise of a demonstration relative to the one before it."""
SMALLEST_UNIT = 1.0
"""Loss above the median that takes a weight from 1 to 1/e in a pool without variety [nats]."""
SPREADS_PER_UNIT = 2.0
"""The same unit in a pool with variety [mean distance of the better half below the median]."""
MOST_REFITS = 200
"""Number of different demonstrations above which leaving one out is one Newton step."""
MOST_FOR_CURVATURE = 1000
"""Largest number of demonstrations, evenly spaced, that give the curvature for that step."""
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
        """(D,) w_d in (0, 1]: 1 for a usual demonstration, towards 0 for an unusual one."""
        return graded(self.losses)


def score(problem: Problem, solved: Solver) -> Score:
    """Return the leave-one-out score, reweighted once; `solved` was fitted to the problem."""
    first = _score_once(problem, solved.weights_, solved.multipliers_)
    multipliers = problem.solve(first.weights, solved.multipliers_)
    return _score_once(problem, first.weights, multipliers)


def _score_once(problem: Problem, weights: NDArray[np.float64], multipliers: Multipliers) -> Score:
    log_p = leave_one_out(problem, weights, multipliers)
    step = log_p.max(axis=1) - log_p[np.arange(len(log_p)), problem.rows.nexts]
    omission = omission_surprises(problem, weights)
    losses = [
        worst_first(mine) + worst_first(omission[demo])
        for demo, mine in enumerate(np.split(step, np.cumsum(problem.steps_per_demo())[:-1]))
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
    numbers, firsts = distinct_demos(problem)
    if len(firsts) > MOST_REFITS:
        return _one_step(problem, weights, multipliers)
    rows = problem.rows
    log_p = np.zeros((len(rows.demos), rows.n_subtasks + 1))
    for number, demo in enumerate(firsts.tolist()):
        refitted = problem.solve(_without(weights, demo), multipliers)
        mine = numbers[rows.demos] == number
        log_p[mine] = log_softmax(rows.states[mine] @ refitted, axis=1)
    return log_p


def _one_step(
    problem: Problem, weights: NDArray[np.float64], multipliers: Multipliers
) -> NDArray[np.float64]:
    """Approximate `leave_one_out` by one Newton step per demonstration from the model of all.

    In a large pool, removing one demonstration changes lambda little. Where the gradient over all
    vanishes, that over the others is -(w_d / (W - w_d)) (grad l_d + ridge lambda), W = sum w, and
    their curvature is close to that of all.
    """
    rows = problem.rows
    some = thinned(rows.n_demos, MOST_FOR_CURVATURE)
    factor = cho_factor(problem.only(some).curvature(multipliers, weights[some]))
    log_p = problem.log_probabilities(multipliers)
    residuals = np.exp(log_p)
    residuals[np.arange(len(residuals)), rows.nexts] -= 1.0
    stops = np.cumsum(problem.steps_per_demo())
    for demos in np.array_split(np.arange(rows.n_demos), 1 + rows.n_demos // 500):
        mine = [slice(stops[d - 1] if d else 0, stops[d]) for d in demos.tolist()]
        slopes = problem.ridge * multipliers + np.stack(
            [rows.states[m].T @ residuals[m] / (m.stop - m.start) for m in mine]
        )
        steps = cho_solve(factor, slopes.reshape(len(demos), -1).T).T.reshape(slopes.shape)
        steps *= (weights[demos] / (weights.sum() - weights[demos]))[:, None, None]
        for rows_of_one, step in zip(mine, steps, strict=True):
            scores = rows.states[rows_of_one] @ (multipliers + step)
            log_p[rows_of_one] = log_softmax(scores, axis=1)
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
    # If no other demonstration is trusted, all others count equally.
    if others.sum() < 1e-9:
        others = np.where(np.arange(len(weights)) == demo, 0.0, 1.0)
    return others
