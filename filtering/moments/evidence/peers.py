"""With whom a demonstration is compared: the trusted ones that look like it.

Another hand, a glove, a lamp or the other side of the table make a video differ from others at all
times, and more at some of them; a mistake makes it differ for a while. Videos that look alike as a
whole therefore say what is usual for each other. The distance of two videos is the quantile BEST of
the log distances of the moments of that one which is found better in the other: what one of them
leaves out or does at another time makes them look no different. Two clusters of average linkage
(Sokal and Michener, 1958) look different where the mean distance between them exceeds that within
them by LEAST_GAP, and are split again by the same rule.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

from filtering.moments.counterparts import Counterparts, Match

Flags = NDArray[np.bool_]
"""(D,) one per demonstration."""
Looks = NDArray[np.int64]
"""(D,) the same number for demonstrations that look alike."""

LEAST_GAP = 0.18
"""Least difference of mean log distances between and within two looks. Where an arm comes from two
sides (`garden`) it is 0.16 to 0.34, and elsewhere in the scenes TUNED_ON mostly below 0.15; with
0.1 to 0.2 the verdicts on those scenes are nearly the same."""
BEST = 0.25
"""Quantile of the log distances of two videos that tells how much they differ at all times."""
FEWEST = 3
"""Least number of demonstrations of a look: each has two others to be compared with."""


@dataclass(frozen=True)
class Peers:
    """Who says what is usual for whom."""

    trusted: Flags
    """(D,) True for demonstrations that say what is usual."""
    looks: Looks
    """(D,) the same number for demonstrations that look alike."""

    def of(self, d: int) -> Flags:
        """Return (D,): the trusted of the same look, or all trusted if there are too few."""
        alike = self.trusted & (self.looks == self.looks[d])
        return alike if alike.sum() >= FEWEST else self.trusted

    def groups(self) -> Iterator[tuple[Flags, Flags]]:
        """Yield for every look its demonstrations, and those that say what is usual for them."""
        for look in np.unique(self.looks):
            members = self.looks == look
            yield members, self.of(int(members.argmax()))


def everybody(looks: Looks) -> Peers:
    """Return the peers where all demonstrations are trusted."""
    return Peers(np.ones(len(looks), dtype=np.bool_), looks)


def looks_of(found: Counterparts) -> Looks:
    """Return (D,): which demonstrations look alike.

    Those of a large pool that are no references have the look of the references that they are
    nearest to.
    """
    far = np.stack([_distances(row) for row in found.there])
    among = far[:, list(found.references)]
    # A video is not compared with itself; its distance is never used.
    among = np.where(np.isnan(among), 0.0, np.minimum(among, among.T))
    clusters = list(_clusters(among, np.arange(len(among))))
    means = np.stack([np.nanmean(far[cluster], axis=0) for cluster in clusters])
    looks = means.argmin(axis=0)
    for look, cluster in enumerate(clusters):
        looks[np.asarray(found.references)[cluster]] = look
    return looks.astype(np.int64)


def _distances(row: Sequence[Match | None]) -> NDArray[np.float64]:
    return np.array([np.nan if match is None else np.quantile(match.near, BEST) for match in row])


def _clusters(far: NDArray[np.float64], members: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Yield the clusters that some of the videos fall into.

    Args:
        far: (R, R) distances between all videos.
        members: (M,) the numbers of those that are looked at.
    """
    inside = far[np.ix_(members, members)]
    first = _half(inside)
    if min(first.sum(), (~first).sum()) < FEWEST:
        yield members
        return
    others = ~np.eye(len(members), dtype=np.bool_)
    same = first[:, None] == first[None, :]
    if inside[~same].mean() - inside[same & others].mean() < LEAST_GAP:
        yield members
        return
    yield from _clusters(far, members[first])
    yield from _clusters(far, members[~first])


def _half(far: NDArray[np.float64]) -> Flags:
    """Return (M,): True for those in one of the two clusters of average linkage."""
    if len(far) < 2 * FEWEST:
        return np.ones(len(far), dtype=np.bool_)
    others = ~np.eye(len(far), dtype=np.bool_)
    positive = np.where(others, far - far[others].min(), 0.0)
    tree = linkage(squareform(positive, checks=False), "average")
    return np.asarray(fcluster(tree, 2, "maxclust") == 1)
