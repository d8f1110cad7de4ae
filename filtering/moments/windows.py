"""Distances between the windows about the moments of two videos."""

import numpy as np
from numpy.typing import NDArray

from filtering.moments.vectors import Vectors

REACH = 8
"""Moments of context on each side: 1.6 s at 5 moments per second, as long as a short step."""


def window_distances(one: Vectors, other: Vectors, reach: int = REACH) -> NDArray[np.float32]:
    """Return (n, m): distance of the windows about moment t of `one` and u of `other`.

    It is the root of the sum over i = -reach..reach of the squared distances of one[t + i] and
    other[u + i]; at the ends of a video its first and last moments stand still.

    Args:
        one: (n, K).
        other: (m, K).
        reach: moments of context on each side.
    """
    n, m = len(one), len(other)
    a = np.pad(one, ((reach, reach), (0, 0)), mode="edge")
    b = np.pad(other, ((reach, reach), (0, 0)), mode="edge")
    squares = np.square(a).sum(axis=1)[:, None] + np.square(b).sum(axis=1) - 2 * (a @ b.T)
    total = squares[:n, :m].copy()
    for shift in range(1, 2 * reach + 1):
        total += squares[shift : shift + n, shift : shift + m]
    return np.sqrt(np.maximum(total, 0.0, out=total), out=total)
