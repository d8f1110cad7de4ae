"""From the losses of the default score to a cut, weights, and groups.

By default the cut on sqrt(loss) lies CUT_SHARE of the way from the mean of the lower cluster to the
mean of the upper one, or VARIETY standard deviations of the lower cluster above its mean, whichever
is smaller: gross mistakes must not hide small ones in a pool whose correct demonstrations are
alike. The cut is never below SMALLEST_CUT, the loss that variety alone explains, so that nothing is
flagged in a clean pool.

Flagged demonstrations are grouped by the nature of their mistakes: out of order, or steps left out.
If `groups` asks for another number, sqrt(loss) is clustered instead.

The constants were chosen together with the structure of the score on CaptainCook4D (8 recipes),
predicted segments of 50 Salads and the UNH tea videos, and checked on recipes that were not used
for the choice (CaptainCook4D and chemistry procedures).
"""

import numpy as np
from numpy.typing import NDArray

from filtering.judging.kmeans import clusters
from filtering.judging.thresholds import DIGITS, Grouping, group_weights
from teasim.common.arrays import Array

SMALLEST_CUT = 2.0
"""Loss up to which nothing is flagged unless a number of groups is asked for [nats]. Chosen on the
data sets above, where clean pools stay below it."""
CUT_SHARE = 0.7
"""Position of the cut between the cluster means of sqrt(loss). Two thirds on the data sets above;
raised to 0.7 because predicted segments led to too many correct demonstrations being flagged."""
VARIETY = 6.0
"""Standard deviations of sqrt(loss) within the lower cluster that count as variety. Chosen on the
rendered tea pools of docs/results.md and 50 Salads."""
LEAST_SPREAD = 0.1
"""Least standard deviation of sqrt(loss) within the lower cluster [sqrt(nats)]. Chosen with
VARIETY."""
NATURES = ("kept", "out of order", "steps left out", "extra steps")
"""Groups of demonstrations, the best first; an ineffective step counts as left out. Extra steps are
known to the learned decision and to moments, not to this cut."""


def decide(losses: Array, left_out: NDArray[np.bool_], groups: str) -> tuple[Array, Grouping]:
    """Return the weights (D,) in [0, 1], one half at the cut, and the groups of a pool.

    Args:
        losses: (D,) of the default score [nats], 0 or more.
        left_out: (D,) True where more of the loss comes from omissions than from the order.
        groups: number of groups, or auto.

    Raises:
        ConfigError: there are fewer demonstrations than groups.
    """
    losses = losses.round(DIGITS)
    cut = cut_of(losses)
    numbers, names = by_nature(losses > cut, left_out)
    if groups != "auto" and int(groups) != numbers.max() + 1:
        clustered = group_weights(-np.sqrt(losses), groups)
        numbers, names = clustered.groups, clustered.names
        cut = clustered.threshold**2 if clustered.count > 1 else cut
    weights = 1 / (1 + (losses / cut) ** 2)
    return weights, Grouping(numbers, 0.5 * (numbers.max() > 0), names)


def by_nature(
    flagged: NDArray[np.bool_],
    left_out: NDArray[np.bool_],
    extra: NDArray[np.bool_] | bool = False,
) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Return group numbers (D,) without gaps and the names of the groups that occur.

    Args:
        flagged: (D,) True for demonstrations called incorrect.
        left_out: (D,) True where omissions weigh more than the order.
        extra: (D,) True where extra steps weigh more than both.
    """
    natures = np.where(flagged, np.where(extra, 3, 1 + left_out), 0)
    present, numbers = np.unique(np.append(0, natures), return_inverse=True)
    return numbers[1:].astype(np.int64), tuple(NATURES[n] for n in present)


def cut_of(losses: Array) -> float:
    """Return the loss above which a demonstration is flagged [nats], for losses (D,)."""
    low, *higher = clusters(np.sqrt(losses), 2)
    if not higher:  # all losses are equal: no demonstration stands out
        return max(float(losses.max()), SMALLEST_CUT)
    between = low.mean() + CUT_SHARE * (higher[0].mean() - low.mean())
    variety = low.mean() + VARIETY * max(low.std(), LEAST_SPREAD)
    return max(float(min(between, variety)) ** 2, SMALLEST_CUT)
