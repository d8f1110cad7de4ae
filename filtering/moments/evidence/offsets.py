"""How far one picture is shifted against another: no camera stands where another stood."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]
"""(..., H, W, 3) cells, 0..255."""

FARTHEST = 5
"""Farthest shift that is looked for [cells]."""
SATURATED = 60.0
"""Difference of two cells, summed over colours, beyond which they are merely different: things that
lie elsewhere must not outweigh the rest."""
BETTER = 0.8
"""Share of the mean difference without a shift that is left at most, or there is none. Pictures of
a camera that stood still differ by their lights and things, which no shift mends."""


class Offset(NamedTuple):
    """A shift in whole cells."""

    down: int
    """Rows by which things lie lower."""
    right: int
    """Columns by which things lie more to the right."""


def offset_between(one: Picture, other: Picture) -> Offset:
    """Return how far `other` is shifted against `one`, both (H, W, 3).

    Small pictures, of less than three times FARTHEST in a direction, have no offset.
    """
    height, width = one.shape[:2]
    if min(height, width) < 3 * FARTHEST:
        return Offset(0, 0)
    inner = one[FARTHEST : height - FARTHEST, FARTHEST : width - FARTHEST]
    reach = range(-FARTHEST, FARTHEST + 1)
    offsets = [Offset(down, right) for down in reach for right in reach]
    apart = {offset: _difference(inner, other, offset) for offset in offsets}
    least = min(offsets, key=lambda offset: (apart[offset], abs(offset.down) + abs(offset.right)))
    return least if apart[least] < BETTER * apart[Offset(0, 0)] else Offset(0, 0)


def shifted_back(pictures: Picture, offset: Offset) -> Picture:
    """Return pictures (..., H, W, 3) as they are without the offset, continued at the edges."""
    if offset == (0, 0):
        return pictures
    height, width = pictures.shape[-3:-1]
    rows = np.clip(np.arange(height) + offset.down, 0, height - 1)
    columns = np.clip(np.arange(width) + offset.right, 0, width - 1)
    return np.asarray(pictures[..., rows[:, None], columns, :])


def _difference(inner: Picture, other: Picture, offset: Offset) -> float:
    """Return the mean difference of the inner part of a picture and the part at an offset."""
    height, width = inner.shape[:2]
    top, left = FARTHEST + offset.down, FARTHEST + offset.right
    there = other[top : top + height, left : left + width]
    apart = np.abs(inner - there).sum(axis=-1)
    return float(np.minimum(apart, SATURATED).mean())
