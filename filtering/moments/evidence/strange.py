"""What is strange in a demonstration: moments that are found worse in others than usual ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts, Match, unless_again
from filtering.moments.evidence.replaced import Side
from filtering.moments.evidence.usual import FEWEST
from filtering.moments.peers.peers import Flags, Looks, Peers, everybody

Array = NDArray[np.float64]

SHARED = 0.2
"""Share of the videos that makes a step one of the task: one that fewer show is extra."""
WELL = 0.25
"""Share of the videos in which a moment is found best; what is extra is compared with them."""


@dataclass(frozen=True)
class Strange:
    """How much worse than others the moments of one demonstration are found in the references."""

    sides: tuple[tuple[Side, ...], ...]
    """Once by nearest moments and once by counterparts, per reference but itself."""
    curves: tuple[Array, ...]
    """(n,) of each way: what a share SHARED of the references says."""


def strange_in(found: Counterparts, looks: Looks) -> list[Strange]:
    """Return per demonstration how strange its moments are, whoever is trusted.

    They are no stranger than among all demonstrations, nor than among those of its look.

    Args:
        found: the counterparts.
        looks: (D,) the same number for demonstrations that look alike.
    """
    among = [_strange_among(found, everybody(np.zeros_like(looks)))]
    if looks.any():
        among.append(_strange_among(found, everybody(looks)))
    return [_least(one) for one in zip(*among, strict=True)]


def _least(among: Sequence[Strange]) -> Strange:
    """Return how strange a demonstration is where it is so least; the sides are of the first."""
    ways = zip(*(one.curves for one in among), strict=True)
    return Strange(among[0].sides, tuple(np.min(way, axis=0) for way in ways))


def _strange_among(found: Counterparts, everyone: Peers) -> list[Strange]:
    """Return per demonstration how strange its moments are among its peers."""
    well = [
        _found_well(row, everyone.of(r))
        for r, row in zip(found.references, found.there, strict=True)
    ]
    results = []
    for d in range(len(found.lengths)):
        matches = [(row[d], best) for row, best in zip(found.back, well, strict=True)]
        both = [_strange(match, best) for match, best in matches if match is not None]
        sides = tuple(zip(*both, strict=True))
        alike = [bool(everyone.of(d)[r]) for r in found.references if r != d]
        results.append(Strange(sides, tuple(_shared(way, alike) for way in sides)))
    return results


def _shared(way: Sequence[Side], alike: Sequence[bool]) -> Array:
    """Return (n,): what a share SHARED of the references that look alike says."""
    curves = [side.curve for side, near in zip(way, alike, strict=True) if near]
    if len(curves) < FEWEST:
        curves = [side.curve for side in way]
    return np.asarray(np.quantile(curves, SHARED, axis=0))


def _found_well(row: Sequence[Match | None], alike: Flags) -> tuple[Array, Array]:
    """Return how far the moments of a reference are where they are found best, in both ways.

    Args:
        row: where they are found, per demonstration.
        alike: (D,) True for those that look like the reference.
    """
    matches = [match for match, near in zip(row, alike, strict=True) if near and match is not None]
    if len(matches) < FEWEST:
        matches = [match for match in row if match is not None]
    near, contested = [m.near for m in matches], [m.contested for m in matches]
    return np.quantile(near, WELL, axis=0), np.quantile(contested, WELL, axis=0)


def _strange(match: Match, well: tuple[Array, Array]) -> tuple[Side, Side]:
    near, contested = well
    return (
        Side(unless_again(match, match.near - near[match.nearest]), match.nearest),
        Side(unless_again(match, match.contested - contested[match.at]), match.at),
    )
