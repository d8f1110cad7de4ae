"""k-means in one dimension, solved exactly: two or three clusters of losses or of weights."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from teasim.common.arrays import Array


def kmeans(values: Array, count: int) -> NDArray[np.int64]:
    """Return the cluster (n,) of each value, 0 for the lowest.

    The sum of squares within the clusters is minimal. Equal values share a cluster; there are
    fewer clusters when there are fewer different values.

    Args:
        values: (n,) one or more finite numbers.
        count: number of clusters, 1, 2 or 3.
    """
    distinct, numbers = np.unique(values, return_counts=True)
    cuts = _best_cuts(distinct, numbers.astype(np.float64), min(count, len(distinct)))
    return np.searchsorted(distinct[list(cuts)], values, side="right").astype(np.int64)


def clusters(values: Array, count: int) -> list[Array]:
    """Return the values (n,) of each cluster, the lowest first."""
    members = kmeans(values, count)
    return [values[members == number] for number in range(int(members.max()) + 1)]


def _best_cuts(values: Array, counts: Array, groups: int) -> tuple[int, ...]:
    """Return where to cut the sorted distinct `values` (n,) so that the sum of squares is least."""
    centred = values - np.average(values, weights=counts)
    number, first, second = (
        np.concatenate([[0.0], np.cumsum(counts * centred**power)]) for power in range(3)
    )

    def within(start: NDArray[np.int64] | int, stop: NDArray[np.int64] | int) -> Any:
        size = number[stop] - number[start]
        return second[stop] - second[start] - (first[stop] - first[start]) ** 2 / size

    n = len(values)
    if groups == 1:
        return ()
    if groups == 2:
        cuts = np.arange(1, n)
        return (1 + int(np.argmin(within(0, cuts) + within(cuts, n))),)
    least, best = np.inf, (1, 2)
    for later in range(2, n):
        earlier = np.arange(1, later)
        costs = within(0, earlier) + within(earlier, later)
        total = costs.min() + within(later, n)
        if total < least:
            least, best = total, (1 + int(costs.argmin()), later)
    return best
