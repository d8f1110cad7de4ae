"""With whom a demonstration is compared: the trusted ones that look like it.

Another hand, a glove, a lamp or the other side of the table make a video differ from others at all
times, and more at some of them; a mistake makes it differ for a while. Videos that look alike as a
whole therefore say what is usual for each other. The distance of two videos is the quantile BEST of
the log distances of the moments of that one which is found better in the other: what one of them
leaves out or does at another time makes them look no different.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts, Match
from filtering.moments.peers.clusters import PARTS, Flags, Rule, clusters

Looks = NDArray[np.int64]
"""(D,) the same number for demonstrations that look alike."""

FEWEST = 3
"""Least number of demonstrations of a look: each has two others to be compared with."""
RULE = Rule(gap=0.16, gap_of_part=0.07, fewest=FEWEST)
"""When moments of two looks differ. Where an arm comes from two sides (`garden`) the gap is 0.17 to
0.34, and 0.08 to 0.2 in each part; elsewhere in the scenes TUNED_ON it is mostly below 0.15. Where
other orders of steps make up the clusters (`lab`), or an oven was left on, some part has less than
0.06."""
BEST = 0.25
"""Quantile of the log distances of two videos that tells how much they differ at all times."""


@dataclass(frozen=True)
class Peers:
    """Who says what is usual for whom."""

    trusted: Flags
    """(D,) True for demonstrations that say what is usual."""
    looks: Looks
    """(D,) the same number for demonstrations that look alike."""

    def of(self, d: int) -> Flags:
        """Return (D,): the trusted of the same look, or all trusted if there are too few."""
        alike = self.alike(d)
        return alike if alike.sum() >= FEWEST else self.trusted

    def alike(self, d: int) -> Flags:
        """Return (D,): the trusted of the same look, however few."""
        return self.trusted & (self.looks == self.looks[d])

    def told_apart(self, looks: Looks) -> "Peers":
        """Return the peers that look alike by other looks, (D,), too."""
        return Peers(self.trusted, both(self.looks, looks))


def everybody(looks: Looks) -> Peers:
    """Return the peers where all demonstrations are trusted."""
    return Peers(np.ones(len(looks), dtype=np.bool_), looks)


def both(looks: Looks, others: Looks) -> Looks:
    """Return (D,): the same number for demonstrations that look alike in two ways."""
    _, together = np.unique(np.stack([looks, others]), axis=1, return_inverse=True)
    return np.asarray(together.reshape(-1), dtype=np.int64)


def looks_of(found: Counterparts) -> Looks:
    """Return (D,): which demonstrations look alike.

    Those of a large pool that are no references have the look of the references that they are
    nearest to.
    """
    far = _distances(found.there)
    rows = [[row[r] for r in found.references] for row in found.there]
    among = _mutual(far[:, list(found.references)])
    parts = [_mutual(_distances(rows, part)) for part in range(PARTS)]
    alike = clusters(among, parts, RULE)
    means = np.stack([np.nanmean(far[cluster], axis=0) for cluster in alike])
    looks = means.argmin(axis=0)
    for look, cluster in enumerate(alike):
        looks[np.asarray(found.references)[cluster]] = look
    return np.asarray(looks, dtype=np.int64)


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
