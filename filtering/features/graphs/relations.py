"""The seven temporal relations between two intervals (paper section 3.2).

Allen's thirteen relations are these seven, of which all but `equals` have a converse. A converse is
no relation of its own: it is the same relation in the other direction.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class Relation(IntEnum):
    """Relation of [a, b) to [c, d); the number is the type of the edge."""

    BEFORE = 0
    """b < c: there is a gap between them."""
    MEETS = 1
    """b = c: one follows the other without a gap."""
    OVERLAPS = 2
    """a < c < b < d: it begins first, ends first, and they share some time."""
    DURING = 3
    """c < a and b < d: it lies inside the other."""
    FINISHES = 4
    """c < a and b = d: it begins later and ends with the other."""
    STARTS = 5
    """a = c and b < d: it begins with the other and ends first."""
    EQUALS = 6
    """a = c and b = d."""


NO_RELATION = -1
"""Entry where a relation holds in the other direction only."""


def relation_matrix(starts: NDArray[np.number], stops: NDArray[np.number]) -> NDArray[np.int64]:
    """Return (I, I): at [i, j] the relation of interval i to interval j, or NO_RELATION.

    Of [i, j] and [j, i] exactly one holds a relation, or both hold EQUALS.

    Args:
        starts: (I,) where the intervals begin.
        stops: (I,) where they end, each after its start.

    Raises:
        ValueError: an interval is empty.
    """
    if (starts >= stops).any():
        raise ValueError("an interval is empty")
    a, b, c, d = starts[:, None], stops[:, None], starts[None, :], stops[None, :]
    conditions = {
        Relation.BEFORE: b < c,
        Relation.MEETS: b == c,
        Relation.OVERLAPS: (a < c) & (c < b) & (b < d),
        Relation.DURING: (c < a) & (b < d),
        Relation.FINISHES: (c < a) & (b == d),
        Relation.STARTS: (a == c) & (b < d),
        Relation.EQUALS: (a == c) & (b == d),
    }
    return np.select(list(conditions.values()), [int(kind) for kind in conditions], NO_RELATION)
