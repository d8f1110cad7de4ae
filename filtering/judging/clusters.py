"""From the losses of the default score to a cut, weights, and groups.

Told nothing, the cut lies seven tenths of the way from the mean of the lower to the mean of the
upper cluster of sqrt(l), or VARIETY standard deviations of the lower one above its mean if that is
nearer: where the usual ones are all alike, gross mistakes must not hide the small ones. It is never
below SMALLEST_CUT: what costs less than that is variety, and nothing is flagged for it, which is
how a clean pool stays clean.

What is flagged is grouped by its nature: first what is out of order, then where steps are left out.
Told another number of groups than there are so, the groups are clusters of sqrt(l).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.judging.kmeans import clusters
from filtering.judging.thresholds import DIGITS, Grouping, group_weights

SMALLEST_CUT = 2.0
"""Losses up to this are never flagged unless the number of groups is told [nats]."""
CUT_SHARE = 0.7
"""Where between the two clusters' means of sqrt(l) the cut lies."""
VARIETY = 6.0
"""Standard deviations of the lower cluster's sqrt(l) that are still variety."""
LEAST_SPREAD = 0.1
"""Least standard deviation of the lower cluster's sqrt(l) [sqrt(nats)]."""
NATURES = ("kept", "out of order", "steps left out")
"""Groups of demonstrations, the best first; a step of which nothing came is as if left out."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Decision:
    """What is to be done with the demonstrations of a pool."""

    weights: Array
    """(D,) in [0, 1], one half at the cut."""
    grouping: Grouping
    """Groups and threshold on the weights."""


def decide(losses: Array, left_out: NDArray[np.bool_], groups: str) -> Decision:
    """Cut and group a pool.

    Args:
        losses: (D,) of the default score [nats], not below zero.
        left_out: (D,) True where a loss is chiefly of steps left out, not of their order.
        groups: how many there are, or auto.

    Raises:
        ConfigError: there are fewer demonstrations than groups.
    """
    losses = losses.round(DIGITS)
    cut = cut_of(losses)
    numbers, names = _by_nature(losses > cut, left_out)
    if groups != "auto" and int(groups) != numbers.max() + 1:
        told = group_weights(-np.sqrt(losses), groups)
        numbers, names = told.groups, told.names
        cut = told.threshold**2 if told.count > 1 else cut
    grouping = Grouping(numbers, 0.5 * (numbers.max() > 0), names)
    return Decision(1 / (1 + (losses / cut) ** 2), grouping)


def _by_nature(
    flagged: NDArray[np.bool_], left_out: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Number what is kept and the NATURES that there are without gaps; return their names too."""
    natures = np.where(flagged, 1 + left_out, 0)
    present, numbers = np.unique(np.append(0, natures), return_inverse=True)
    return numbers[1:].astype(np.int64), tuple(NATURES[n] for n in present)


def cut_of(losses: Array) -> float:
    """Loss above which a demonstration is flagged [nats], for losses (D,)."""
    low, *higher = clusters(np.sqrt(losses), 2)
    if not higher:  # all alike: nobody stands out
        return max(float(losses.max()), SMALLEST_CUT)
    between = low.mean() + CUT_SHARE * (higher[0].mean() - low.mean())
    variety = low.mean() + VARIETY * max(low.std(), LEAST_SPREAD)
    return max(float(min(between, variety)) ** 2, SMALLEST_CUT)
