"""From weights to groups: exact one-dimensional k-means and its mid-points (paper section 3.3).

The paper is told the number of groups. Here it can also be chosen from the data, one group
included: in a clean pool nothing is flagged.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from teasim.errors import ConfigError

GROUPS = ("auto", "1", "2", "3")
"""What may be asked for."""
MIN_GAP = 0.5
"""Least distance between the mean weights of two groups for them to be two [weight]."""
MIN_GAP_OF_THREE = 0.25
"""Least distance between neighbouring means of three groups [weight]."""


@dataclass(frozen=True)
class Grouping:
    """The groups of a pool's demonstrations."""

    groups: NDArray[np.int64]
    """(D,) group of each demonstration; 0 has the highest weights and is kept."""
    threshold: float
    """Weight below which a demonstration is flagged; 0 when there is one group."""

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """(D,) True for every demonstration outside group 0."""
        return self.groups > 0

    @property
    def count(self) -> int:
        """Number of groups."""
        return int(self.groups.max()) + 1


def group_weights(weights: NDArray[np.float64], groups: str = "auto") -> Grouping:
    """Split weights (D,) into groups and put the threshold between group 0 and group 1.

    Asked-for groups are fewer when there are fewer different weights than groups.

    Raises:
        ConfigError: `groups` is none of GROUPS, or more than there are demonstrations.
    """
    if groups not in GROUPS:
        raise ConfigError(f"Unknown number of groups '{groups}'; choose {', '.join(GROUPS)}.")
    if groups == "auto":
        return _chosen_from_data(weights)
    if int(groups) > len(weights):
        raise ConfigError(
            f"{groups} groups were asked for but there are only {len(weights)} demonstrations; "
            f"choose auto or at most {len(weights)}."
        )
    return _grouping(weights, min(int(groups), len(np.unique(weights))))


def _chosen_from_data(weights: NDArray[np.float64]) -> Grouping:
    distinct = len(np.unique(weights))
    two = _grouping(weights, min(2, distinct))
    if _smallest_gap(weights, two) < MIN_GAP:
        return _grouping(weights, 1)
    if distinct < 3:
        return two
    three = _grouping(weights, 3)
    clear = _smallest_gap(weights, three) >= MIN_GAP_OF_THREE
    better = _silhouette(weights, three) > _silhouette(weights, two)
    # A third group may refine what is flagged, but must not take demonstrations from the kept ones.
    same_kept = np.array_equal(two.flagged, three.flagged)
    return three if clear and better and same_kept else two


def _grouping(weights: NDArray[np.float64], count: int) -> Grouping:
    """Return the exact k-means solution; equal weights always share a group."""
    values = np.unique(weights)[::-1]
    best = min(
        combinations(range(1, len(values)), count - 1),
        key=lambda cuts: _within(weights, _assign(weights, values, cuts)),
    )
    groups = _assign(weights, values, best)
    if count == 1:
        return Grouping(groups, 0.0)
    middle = (weights[groups == 0].mean() + weights[groups == 1].mean()) / 2
    # The mid-point of the means may fall inside a wide group; the groups decide: keep it between.
    lowest_kept, highest_flagged = weights[groups == 0].min(), weights[groups == 1].max()
    inside = highest_flagged < middle <= lowest_kept
    return Grouping(groups, float(middle if inside else (lowest_kept + highest_flagged) / 2))


def _assign(
    weights: NDArray[np.float64], values: NDArray[np.float64], cuts: tuple[int, ...]
) -> NDArray[np.int64]:
    """Return (D,) groups when the falling distinct `values` are cut before these positions."""
    bounds = values[list(cuts)] if cuts else np.empty(0)
    below: NDArray[np.bool_] = weights[:, None] <= bounds[None, :]
    return np.count_nonzero(below, axis=1).astype(np.int64)


def _within(weights: NDArray[np.float64], groups: NDArray[np.int64]) -> float:
    parts = [weights[groups == group] for group in np.unique(groups)]
    return float(sum(((part - part.mean()) ** 2).sum() for part in parts))


def _smallest_gap(weights: NDArray[np.float64], grouping: Grouping) -> float:
    means = [weights[grouping.groups == group].mean() for group in range(grouping.count)]
    return float(min(-np.diff(means), default=0.0))


def _silhouette(weights: NDArray[np.float64], grouping: Grouping) -> float:
    """Return the mean silhouette; a demonstration alone in its group counts 0, as is the custom."""
    distances = np.abs(weights[:, None] - weights[None, :])
    values = np.zeros(len(weights))
    for index, group in enumerate(grouping.groups):
        own = grouping.groups == group
        if own.sum() == 1:
            continue
        inner = distances[index, own].sum() / (own.sum() - 1)
        outer = min(
            distances[index, grouping.groups == other].mean()
            for other in range(grouping.count)
            if other != group
        )
        values[index] = (outer - inner) / max(inner, outer, 1e-12)
    return float(values.mean())
