"""Whether a stretch without a counterpart is left out, or done in another way.

Where a step is left out, what came before it and what came after it are neighbours: no time passes
between them in the other video. Where it is done in another way, with another posture or another
hand, its time passes, and is filled with moments that have no counterpart either. The same holds
for what is extra, seen from the other side.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FOUND = float(np.log(1.3))
"""Largest log of how much farther than usual a counterpart may be to count as found."""
UNUSUAL = FOUND / 2
"""Least evidence of a moment that fills the time of another one."""
NEIGHBOURS = 6
"""Moments on each side of a stretch from which it is told where it would be: 1.2 s."""
FILLED = (0.5, 0.85)
"""Share of the time of a stretch that must be filled for it to be replaced at all, and altogether:
rests and the edges of other steps fill some of it, and nobody is as fast as somebody else."""


class Side(NamedTuple):
    """One of two videos that are compared."""

    curve: Array
    """(n,) evidence that its moments have no counterpart in the other."""
    at: NDArray[np.int64]
    """(n,) their counterparts."""


def replaced(one: Side, other: Array, start: int, stop: int) -> float:
    """Return how far a stretch is replaced, in [0, 1]: its time is filled with something unusual.

    Args:
        one: the video that shows the stretch.
        other: (m,) evidence that the moments of the other video have no counterpart.
        start: first moment of the stretch in `one`.
        stop: moment after its last one.
    """
    first, last = _expected(one, start, stop, len(other))
    share = float((other[first:last] > UNUSUAL).sum()) / (stop - start)
    return float(np.clip((share - FILLED[0]) / (FILLED[1] - FILLED[0]), 0.0, 1.0))


def _expected(one: Side, start: int, stop: int, length: int) -> tuple[int, int]:
    """Return from where to where the other video of this length would show a stretch."""
    found = np.flatnonzero(one.curve < FOUND)
    before, after = found[found < start][-NEIGHBOURS:], found[found >= stop][:NEIGHBOURS]
    first = np.median(one.at[before] + start - before) if len(before) else 0
    last = np.median(one.at[after] + stop - after) if len(after) else length
    return max(int(first), 0), min(max(int(last), 0), length)
