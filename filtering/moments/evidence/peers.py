"""With whom a demonstration is compared: the trusted ones that look like it.

Another hand, a glove, a lamp or the other side of the table make a video differ from others at all
times, and more at some of them; a mistake makes it differ for a while. Videos that look alike as a
whole therefore say what is usual for each other. The distance of two videos is the quantile BEST of
the log distances of the moments of that one which is found better in the other: what one of them
leaves out or does at another time makes them look no different. Two clusters of average linkage
(Sokal and Michener, 1958) look different where the mean distance between them exceeds that within
them by LEAST_GAP, and are split again by the same rule. What comes of a mistake may be seen until
the end, as of an oven that was left on; so they have to differ in each third of the videos.
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

LEAST_GAP = 0.16
"""Least difference of mean log distances between and within two looks. Where an arm comes from two
sides (`garden`) it is 0.17 to 0.34, and elsewhere in the scenes TUNED_ON mostly below 0.15."""
PARTS = 3
"""Parts of equal length of a video, in each of which two looks differ."""
LEAST_GAP_OF_PART = 0.07
"""Least such difference in each part. In `garden` it is 0.08 to 0.2; where other orders of steps
make up the clusters (`lab`), or an oven was left on, it is below 0.06."""
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
    far = _distances(found.there)
    rows = [[row[r] for r in found.references] for row in found.there]
    among = _mutual(far[:, list(found.references)])
    parts = np.stack([_mutual(_distances(rows, part)) for part in range(PARTS)])
    clusters = list(_clusters(among, parts, np.arange(len(among))))
    means = np.stack([np.nanmean(far[cluster], axis=0) for cluster in clusters])
    looks = means.argmin(axis=0)
    for look, cluster in enumerate(clusters):
        looks[np.asarray(found.references)[cluster]] = look
    return looks.astype(np.int64)


def _distances(
    rows: Sequence[Sequence[Match | None]], part: int | None = None
) -> NDArray[np.float64]:
    """Return (R, K): how far K videos are from R references, in all moments or one of PARTS."""

    def distance(match: Match | None) -> float:
        if match is None:
            return np.nan
        near = match.near if part is None else np.array_split(match.near, PARTS)[part]
        return float(np.quantile(near, BEST)) if len(near) else np.nan

    return np.array([[distance(match) for match in row] for row in rows])


def _mutual(far: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (R, R): the lesser of the distances of two references; 0, never used, from itself."""
    return np.where(np.isnan(far), 0.0, np.minimum(far, far.T))


def _clusters(
    far: NDArray[np.float64], parts: NDArray[np.float64], members: NDArray[np.int64]
) -> Iterator[NDArray[np.int64]]:
    """Yield the clusters that some of the videos fall into.

    Args:
        far: (R, R) distances between all videos.
        parts: (PARTS, R, R) the same in each part of the videos.
        members: (M,) the numbers of those that are looked at.
    """
    inside = far[np.ix_(members, members)]
    first = _half(inside)
    if min(first.sum(), (~first).sum()) < FEWEST:
        yield members
        return
    in_parts = [_gap(part[np.ix_(members, members)], first) for part in parts]
    if _gap(inside, first) < LEAST_GAP or min(in_parts) < LEAST_GAP_OF_PART:
        yield members
        return
    yield from _clusters(far, parts, members[first])
    yield from _clusters(far, parts, members[~first])


def _gap(far: NDArray[np.float64], first: Flags) -> float:
    """Return how much farther videos of two clusters are from each other than those of one."""
    others = ~np.eye(len(far), dtype=np.bool_)
    same = first[:, None] == first[None, :]
    return float(far[~same].mean() - far[same & others].mean())


def _half(far: NDArray[np.float64]) -> Flags:
    """Return (M,): True for those in one of the two clusters of average linkage."""
    if len(far) < 2 * FEWEST:
        return np.ones(len(far), dtype=np.bool_)
    others = ~np.eye(len(far), dtype=np.bool_)
    positive = np.where(others, far - far[others].min(), 0.0)
    tree = linkage(squareform(positive, checks=False), "average")
    return np.asarray(fcluster(tree, 2, "maxclust") == 1)
