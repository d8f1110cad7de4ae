"""What lies in each cell of a picture at rest, and what changes there about a moment."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts
from filtering.moments.evidence.stretches import Stretch
from filtering.moments.vectors import Video

Change = NDArray[np.float32]
"""(H, W, 3) what each cell changes by, -255..255."""
States = NDArray[np.float32]
"""(n, H, W, 3) what lies where, hands and arms taken out."""

REACH = 8
"""Moments before and after which the picture is compared; those of `windows.REACH`."""
LATER = 2
"""How much farther before and after it is looked whether a change lasts [REACH]."""
LASTING_SHARE = 0.5
"""Share of a change that must still be there farther on: what an arm covers for a while is no
effect."""
LEAST_CHANGE = 12.0
"""Least change of a cell that counts, 0..255."""
CELLS = 4
"""Least number of cells that change: a thing fills as many."""
STILL = 2
"""Moments on each side over which the median is taken."""
BLUR = 0.7
"""Standard deviation of the blur [cells]."""


def states_of(video: Video) -> States:
    """Return (n, H, W, 3): cells of equal brightness, blurred, medians over a few moments."""
    import cv2

    blurred = np.stack([cv2.GaussianBlur(image, (0, 0), BLUR) for image in video.lit_alike()])
    padded = np.pad(blurred, ((STILL, STILL), (0, 0), (0, 0), (0, 0)), mode="edge")
    shifted = [padded[shift : shift + len(video)] for shift in range(2 * STILL + 1)]
    return np.median(shifted, axis=0).astype(np.float32)


def change_at(states: States, before: int, after: int) -> Change:
    """Return (H, W, 3): what is there at the moment `after` minus what was there `before`."""
    last = len(states) - 1
    return np.asarray(states[min(after, last)] - states[max(before, 0)])


def change_about(own: States, found: Counterparts, row: int, d: int, moment: int) -> Change:
    """Return (H, W, 3): what changes in video d about the counterpart of a moment of a reference.

    Args:
        own: states of video d.
        found: the counterparts.
        row: row of the reference.
        d: number of the video.
        moment: moment of the reference.
    """
    at = place_of(found, row, d, moment)
    return change_at(own, at - REACH, at + REACH)


def later_about(own: States, found: Counterparts, row: int, d: int, moment: int) -> Change:
    """Return (H, W, 3): the change between moments LATER times as far before and after."""
    return change_at(own, *around(found, row, d, moment, LATER * REACH))


def around(found: Counterparts, row: int, d: int, moment: int, reach: int) -> tuple[int, int]:
    """Return the counterparts in d of the moments `reach` before and after one of the reference."""
    before, after = ends_about(moment, reach, found.lengths[found.references[row]])
    return place_of(found, row, d, before), place_of(found, row, d, after)


def ends_about(moment: int, reach: int, length: int) -> tuple[int, int]:
    """Return the moments `reach` before and after one of a video, or its first and last ones."""
    return max(moment - reach, 0), min(moment + reach, length - 1)


def place_of(found: Counterparts, row: int, d: int, moment: int) -> int:
    """Return the counterpart in d of a moment of the reference, itself in the reference."""
    match = found.there[row][d]
    return moment if match is None else int(match.at[moment])


def lasting_sizes(change: NDArray[np.floating[Any]], later: Change) -> NDArray[np.float64]:
    """Return (H, W): how much each cell changes, 0 where it changes back or hardly at all.

    Args:
        change: (H, W, 3).
        later: (H, W, 3) the change between moments farther before and after.
    """
    sizes = np.linalg.norm(change, axis=-1)
    lasts = (change * later).sum(axis=-1) >= LASTING_SHARE * np.square(sizes)
    return np.where(lasts & (sizes >= LEAST_CHANGE), sizes, 0.0)


def stretch_about(found: Counterparts, video: int, moment: int) -> Stretch:
    """Return the stretch of a video before and after a moment in which a change comes about."""
    before, after = ends_about(moment, REACH, found.lengths[video])
    return Stretch(video, before, after + 1)
