"""How much the videos of a pool have in common."""

import numpy as np

from filtering.moments.counterparts import ROUND_TRIP, Counterparts


def shared_structure(found: Counterparts) -> float:
    """Return how many more moments return from a round trip than by chance, at most 1.

    That is (r - c) / (1 - c) in the median pair of videos, with the share r of the moments that
    return, and the share c that a place drawn at random would be near enough to. Videos of few
    moments have a large c.
    """
    shares = []
    for row, back in zip(found.there, found.back, strict=True):
        for there, returned in zip(row, back, strict=True):
            if there is None or returned is None:
                continue
            count = len(there.nearest)
            # Places that are contested would make even noise agree.
            missed = np.abs(returned.nearest[there.nearest] - np.arange(count))
            usual = _share_near(count)
            shares.append(((missed <= ROUND_TRIP).mean() - usual) / (1 - usual))
    return float(np.median(shares))


def _share_near(count: int) -> float:
    """Return the share of pairs of `count` moments that are at most ROUND_TRIP apart, below 1.

    There are count - k pairs of moments that are k apart, in either order; `count` is at least
    FEWEST_MOMENTS.
    """
    near = count + 2 * sum(count - apart for apart in range(1, ROUND_TRIP + 1))
    return near / count**2
