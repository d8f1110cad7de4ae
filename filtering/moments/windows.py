"""Distances between the windows about the moments of two videos."""

import numpy as np
from numpy.typing import NDArray

from filtering.moments.vectors import Vectors

REACH = 8
"""Moments of context on each side: 1.6 s at 5 moments per second, as long as a short step."""
PACES = ((1.0, 1.0), (0.75, 1.0), (1.0, 0.75), (0.6, 1.0), (1.0, 0.6))
"""How fast the two videos go within a window: as fast as each other, or one of them slower. The
pair that fits best counts. Videos at 0.8 and 1.25 times the usual tempo meet at 0.64."""


def window_distances(one: Vectors, other: Vectors, reach: int = REACH) -> NDArray[np.float32]:
    """Return (n, m): distance of the windows about moment t of `one` and u of `other`.

    It is the least over the paces (p, q) of the root of the sum over i = -reach..reach of the
    squared distances of one[t + p i] and other[u + q i], places rounded; at the ends of a video
    its first and last moments stand still.

    Args:
        one: (n, K).
        other: (m, K).
        reach: moments of context on each side.
    """
    n, m = len(one), len(other)
    a = np.pad(one, ((reach, reach), (0, 0)), mode="edge")
    b = np.pad(other, ((reach, reach), (0, 0)), mode="edge")
    squares = np.square(a).sum(axis=1)[:, None] + np.square(b).sum(axis=1) - 2 * (a @ b.T)
    least = np.full((n, m), np.inf, dtype=np.float32)
    for pace in PACES:
        total = np.zeros((n, m), dtype=np.float32)
        for shift in range(-reach, reach + 1):
            row, column = (reach + round(part * shift) for part in pace)
            total += squares[row : row + n, column : column + m]
        np.minimum(least, total, out=least)
    return np.sqrt(np.maximum(least, 0.0, out=least), out=least)
