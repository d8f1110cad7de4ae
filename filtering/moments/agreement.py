"""Sub-tasks found by agreement: stretches that most videos show, cut where they come apart.

Seen from one reference, neighbouring moments belong together while their counterparts are
neighbours in the other videos too. Where two steps are done in another order, or something comes
between them, the counterparts jump, and there a border lies. The share of the videos whose
counterparts jump is how sure a border is; the share that has a counterpart at all is how sure a
stretch is. Tasks done in one order alone by everybody have no borders to be found in this way.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts, Match, how_far
from filtering.moments.evidence.replaced import FOUND

Array = NDArray[np.float64]

LAG = 4
"""Moments on each side between which a jump is looked for."""
JUMP = 2 * LAG
"""How much farther than in the reference counterparts of neighbours may lie apart [moments]."""
LEAST_JUMPS = 0.15
"""Share of the videos that jump from which there is a border."""
LEAST_SEEN = 0.5
"""Share of the videos that show a stretch for it to be a sub-task."""
SHORTEST = 5
"""Moments that a sub-task lasts at least: 1 s at 5 moments per second."""


@dataclass(frozen=True)
class AgreedStretch:
    """A sub-task as the reference shows it."""

    start: int
    """First moment in the reference."""
    stop: int
    """Moment after the last one."""
    seen: float
    """Share of the other videos that show it, how sure it is."""
    spans: tuple[tuple[int, int] | None, ...]
    """Per video its (start, stop) in moments; None where it is not shown."""


@dataclass(frozen=True)
class Agreement:
    """The sub-tasks that most videos of a pool show."""

    reference: int
    """Number of the video they were found in, the most central one."""
    stretches: tuple[AgreedStretch, ...]
    """In the order of time of the reference."""
    borders: tuple[float, ...]
    """Share of the videos that jump at each border between neighbours, how sure it is."""


def agree(found: Counterparts) -> Agreement:
    """Find the sub-tasks that most videos show."""
    row = _most_central(found)
    reference = found.references[row]
    matches = [match for match in found.there[row] if match is not None]
    far = np.stack([match.contested for match in matches])
    shown = far - np.median(far, axis=0) < FOUND
    jumps = np.stack([jumps_of(match) for match in matches]).mean(axis=0)
    borders = _borders(jumps)
    edges = [0, *borders, found.lengths[reference]]
    stretches = []
    for start, stop in pairwise(edges):
        seen = shown[:, start:stop].mean(axis=1) >= LEAST_SEEN
        spans = iter(
            _span(match, start, stop) if there else None
            for match, there in zip(matches, seen, strict=True)
        )
        everyone = tuple(
            (start, stop) if match is None else next(spans) for match in found.there[row]
        )
        stretches.append(AgreedStretch(start, stop, float(seen.mean()), everyone))
    kept = tuple(one for one in stretches if one.seen >= LEAST_SEEN)
    return Agreement(reference, kept, tuple(float(jumps[border]) for border in borders))


def jumps_of(match: Match) -> NDArray[np.bool_]:
    """Return (n,): whether the counterparts before and after each moment are no neighbours."""
    at = match.at
    moments = np.arange(len(at))
    before = at[np.maximum(moments - LAG, 0)]
    after = at[np.minimum(moments + LAG, len(at) - 1)]
    return np.asarray((after < before) | (after - before > 2 * LAG + JUMP))


def _borders(jumps: Array) -> list[int]:
    """Return the moments at which most videos of their surroundings jump."""
    borders: list[int] = []
    for moment in np.argsort(-jumps, kind="stable").tolist():
        if jumps[moment] < LEAST_JUMPS:
            break
        apart = [abs(moment - other) for other in (0, len(jumps), *borders)]
        if min(apart) >= SHORTEST + LAG:
            borders.append(moment)
    return sorted(borders)


def _span(match: Match, start: int, stop: int) -> tuple[int, int]:
    """Return where the middle of the counterparts of a stretch lies."""
    low, high = np.quantile(match.at[start:stop], (0.1, 0.9))
    return int(low), int(high) + 1


def _most_central(found: Counterparts) -> int:
    return int(np.argmin([how_far(row) for row in found.there]))
