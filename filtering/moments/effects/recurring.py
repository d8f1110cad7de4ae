"""Changes that come about again and again in one place, such as a hand that comes back to rest.

What a step leaves behind stays until another step changes it. A place that looks as after a change,
as before it and as after it again, several times, is one where something rests between steps.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

ALIKE = 0.5
"""Share of a change within which a cell looks as before or after it; else something covers it."""


def recurrences(places: NDArray[np.floating[Any]], moment: int, reach: int) -> NDArray[np.int64]:
    """Return (C,): how often each of C cells comes to look as after a moment, from as before it.

    Args:
        places: (n, C, 3) what lies in the cells at each moment.
        moment: the moment of the change.
        reach: moments before and after it at which the cells are looked at.
    """
    before, after = places[max(moment - reach, 0)], places[min(moment + reach, len(places) - 1)]
    near = ALIKE * np.linalg.norm(after - before, axis=1)
    is_after = np.linalg.norm(places - after, axis=2) < near
    is_before = np.linalg.norm(places - before, axis=2) < near
    times = np.zeros(places.shape[1], dtype=np.int64)
    was_before = np.zeros(places.shape[1], dtype=np.bool_)
    for now_after, now_before in zip(is_after, is_before, strict=True):
        times += was_before & now_after
        was_before = (was_before | now_before) & ~now_after
    return times
