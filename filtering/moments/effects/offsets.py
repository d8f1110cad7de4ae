"""How far what changes in one picture lies from what changes in another.

No camera stands where another stood, and things do not lie where they lay. Light, colours and what
else is in the picture may differ altogether, so that pictures cannot be laid over each other; what
the same steps change can.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from filtering.moments.effects.changes import CELLS, LEAST_CHANGE

FARTHEST = 8
"""Farthest shift that is looked for [cells]. Under the random look the cup lies up to 7 cells
elsewhere, in the bank of tea-making that this was made on."""
SATURATED = 40.0
"""Most that the change of a cell counts, 0..255; set by hand."""
BETTER = 0.8
"""A shift is taken only if the overlap without it is less than this share of the overlap with it:
where each thing lies elsewhere, no shift brings them together. Set by hand."""
LEAST_GAIN = CELLS * LEAST_CHANGE**2
"""Least overlap that a shift must bring: that of the least change of one thing."""


class Offset(NamedTuple):
    """A shift in whole cells."""

    down: int
    """Rows by which things lie lower."""
    right: int
    """Columns by which things lie more to the right."""


def offset_between(one: NDArray[np.floating[Any]], other: NDArray[np.floating[Any]]) -> Offset:
    """Return how far the changes of `other` lie from those of `one`.

    It is the shift with the largest overlap, the sum over moments and cells of the products.

    Args:
        one: (T, H, W) how much each cell changes at each moment, 0..255.
        other: (T, H, W) the same of the other video, at the counterparts of the moments.
    """
    size = (one.shape[1] + FARTHEST, one.shape[2] + FARTHEST)
    here, there = (np.fft.rfft2(np.minimum(each, SATURATED), size) for each in (one, other))
    overlaps = np.fft.irfft2((np.conj(here) * there).sum(axis=0), size)
    reach = np.arange(-FARTHEST, FARTHEST + 1)
    near = overlaps[np.ix_(reach % size[0], reach % size[1])]
    down, right = np.unravel_index(near.argmax(), near.shape)
    without, best = near[FARTHEST, FARTHEST], near[down, right]
    if without >= BETTER * best or best - without < LEAST_GAIN:
        return Offset(0, 0)
    return Offset(int(reach[down]), int(reach[right]))


def shifted_back(pictures: NDArray[np.float32], offset: Offset) -> NDArray[np.float32]:
    """Return pictures (..., H, W, 3) as they are without the offset, continued at the edges."""
    if offset == (0, 0):
        return pictures
    height, width = pictures.shape[-3:-1]
    rows = np.clip(np.arange(height) + offset.down, 0, height - 1)
    columns = np.clip(np.arange(width) + offset.right, 0, width - 1)
    return np.asarray(pictures[..., rows[:, None], columns, :])
