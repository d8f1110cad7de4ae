"""Clusters of demonstrations that differ in each part of their videos.

Two clusters of average linkage (Sokal and Michener, 1958) are two looks where the mean distance
between them exceeds that within them by enough, in the videos as a whole and in each third of them,
and are split again by the same rule. What comes of a mistake may be seen until the end, as of an
oven that was left on, but not from the beginning.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

Flags = NDArray[np.bool_]
"""(D,) one per demonstration."""
Array = NDArray[np.float64]

PARTS = 3
"""Parts of equal length of a video, in each of which two looks differ."""


@dataclass(frozen=True)
class Rule:
    """When two clusters are two looks."""

    gap: float
    """Least difference of the mean distances between and within them, in whole videos."""
    gap_of_part: float
    """Least such difference in each of PARTS."""
    fewest: int
    """Least number of demonstrations of a look."""


def clusters(far: Array, parts: Sequence[Array], rule: Rule) -> list[NDArray[np.int64]]:
    """Return the clusters that R videos fall into, as the numbers of their members.

    Args:
        far: (R, R) distances between the videos.
        parts: PARTS of (R, R), the same in each part of the videos.
        rule: when two clusters are two looks.
    """
    return list(_split(far, parts, rule, np.arange(len(far))))


def _split(
    far: Array, parts: Sequence[Array], rule: Rule, members: NDArray[np.int64]
) -> Iterator[NDArray[np.int64]]:
    inside = far[np.ix_(members, members)]
    first = _half(inside, rule.fewest)
    if min(first.sum(), (~first).sum()) < rule.fewest:
        yield members
        return
    in_parts = [_gap(part[np.ix_(members, members)], first) for part in parts]
    if _gap(inside, first) < rule.gap or min(in_parts) < rule.gap_of_part:
        yield members
        return
    yield from _split(far, parts, rule, members[first])
    yield from _split(far, parts, rule, members[~first])


def _gap(far: Array, first: Flags) -> float:
    """Return how much farther videos of two clusters are from each other than those of one."""
    others = ~np.eye(len(far), dtype=np.bool_)
    same = first[:, None] == first[None, :]
    return float(far[~same].mean() - far[same & others].mean())


def _half(far: Array, fewest: int) -> Flags:
    """Return (M,): True for those in one of the two clusters of average linkage."""
    if len(far) < max(2 * fewest, 3):  # of two videos neither is the usual one
        return np.ones(len(far), dtype=np.bool_)
    others = ~np.eye(len(far), dtype=np.bool_)
    positive = np.where(others, far - far[others].min(), 0.0)
    tree = linkage(squareform(positive, checks=False), "average")
    return np.asarray(fcluster(tree, 2, "maxclust") == 1)
