"""Steps of which nothing came: what usually changes in the picture, and did not.

At moment t of a reference and at its counterpart in every video, what lies in each cell is compared
before and after, x_k(t): cells REACH moments later minus REACH moments earlier. Hands and arms pass
by, so that a median over a few moments takes them out. m(t), the median of x_k over the videos, is
what usually changes here. A video has of it

    p_k = max over the neighbourhood of the cell of <x_k, m> / |m|,

in a neighbourhood because no camera stands where another stood, and lacks

    (q - p_k) / sqrt(s^2 + NOISE^2 + (SHARE q)^2),       q the quantile VARIETY of p, s its MAD,

which is about 1 / SHARE where nothing came of it and near 0 where it is as usual. Only changes that
most videos show in the same cells count: what is carried from a place of its own to a common place
is missed there. Windows of moments say where to look, so any order of steps will do.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts
from filtering.moments.evidence import VARIETY, Evidence, Stretch
from filtering.moments.vectors import Video

Array = NDArray[np.float64]
States = NDArray[np.float16]
"""(n, H, W, 3) what lies where, hands and arms taken out."""

REACH = 8
"""Moments before and after which the picture is compared; those of `windows.REACH`."""
STRIDE = 2
"""Every second moment is looked at."""
OBSERVERS = 3
"""References from which is told where to look, the most central ones."""
STILL = 2
"""Moments on each side over which the median is taken."""
BLUR = 0.7
"""Standard deviation of the blur [cells]."""
NEIGHBOURHOOD = 2
"""How far a thing may lie from where it usually does [cells]."""
LEAST_CHANGE = 12.0
"""Least usual change of a cell that counts, 0..255."""
NOISE = 5.0
"""Scatter of a change that is always allowed for, 0..255."""
SHARE = 0.15
"""The same in proportion to the change."""
MOST_CELLS = 300
"""Most cells looked at at a moment, those that change most."""
CELLS = 4
"""The mean of so many cells that lack most counts: a thing fills as many."""
MOMENTS = 3
"""The mean of so many moments counts."""
BRIGHTNESS = 110.0
"""Median brightness that every video is scaled to, 0..255."""


@dataclass(frozen=True)
class Usual:
    """What usually changes about one moment of one reference."""

    moment: int
    """The moment."""
    rows: NDArray[np.int64]
    """(C,) rows of the cells that change."""
    columns: NDArray[np.int64]
    """(C,) their columns."""
    directions: Array
    """(C, 3) colour direction in which each changes, of length 1."""
    amounts: Array
    """(C,) how much it changes in most videos."""
    scatters: Array
    """(C,) how much the amount scatters."""

    def lack(self, change: Array) -> float:
        """Return how much of the usual change a change (H, W, 3) lacks."""
        seen = _amounts(change, self.rows, self.columns, self.directions)
        lacks = (self.amounts - seen) / self.scatters
        return float(np.sort(lacks)[-CELLS:].mean())


class _View(NamedTuple):
    """What is usual from the viewpoint of one reference."""

    row: int
    """Row of the reference."""
    usual: list[Usual]
    """What usually changes, in order of time."""


def ineffective(found: Counterparts, videos: Sequence[Video]) -> Evidence:
    """Return the evidence that nothing came of a step of each demonstration."""
    views = _views(found, videos)
    results = [_lacking(found, views, d, states_of(video)) for d, video in enumerate(videos)]
    values, own, other = zip(*results, strict=True)
    return Evidence(np.array(values), tuple(own), tuple(other))


def states_of(video: Video) -> States:
    """Return (n, H, W, 3): cells of equal brightness, blurred, medians over a few moments."""
    import cv2

    cells = video.cells.astype(np.float32)
    cells *= BRIGHTNESS / max(float(np.median(cells)), 1.0)
    blurred = np.stack([cv2.GaussianBlur(image, (0, 0), BLUR) for image in cells])
    padded = np.pad(blurred, ((STILL, STILL), (0, 0), (0, 0), (0, 0)), mode="edge")
    shifted = [padded[shift : shift + len(cells)] for shift in range(2 * STILL + 1)]
    return np.median(shifted, axis=0).astype(np.float16)


def change_at(states: States, moment: int) -> Array:
    """Return (H, W, 3): what is there after a moment minus what was there before."""
    after = states[min(moment + REACH, len(states) - 1)].astype(np.float64)
    return np.asarray(after - states[max(moment - REACH, 0)])


def usual_change(moment: int, changes: Array) -> Usual | None:
    """Return what most videos change, from their changes (D, H, W, 3); None if that is little."""
    median = np.median(changes, axis=0)
    sizes = np.linalg.norm(median, axis=-1)
    flat = np.argsort(-sizes.ravel(), kind="stable")[:MOST_CELLS]
    flat = flat[sizes.ravel()[flat] >= LEAST_CHANGE]
    if len(flat) < CELLS:
        return None
    rows, columns = np.unravel_index(flat, sizes.shape)
    directions = median[rows, columns] / sizes[rows, columns][:, None]
    seen = np.stack([_amounts(change, rows, columns, directions) for change in changes])
    amounts = np.quantile(seen, VARIETY, axis=0)
    mad = 1.4826 * np.median(np.abs(seen - np.median(seen, axis=0)), axis=0)
    scatters = np.sqrt(mad**2 + NOISE**2 + (SHARE * amounts) ** 2)
    return Usual(moment, rows, columns, directions, amounts, scatters)


def _views(found: Counterparts, videos: Sequence[Video]) -> list[_View]:
    states = {r: states_of(videos[r]) for r in found.references}
    views = []
    for row in _central(found):
        usual = []
        for moment in range(0, found.lengths[found.references[row]], STRIDE):
            changes = [change_at(states[k], _place(found, row, k, moment)) for k in states]
            known = usual_change(moment, np.stack(changes))
            if known is not None:
                usual.append(known)
        views.append(_View(row, usual))
    return views


def _central(found: Counterparts) -> list[int]:
    """Return the rows of the most central references."""
    far = [
        float(np.median([np.median(match.near) for match in row if match is not None]))
        for row in found.there
    ]
    return np.argsort(far, kind="stable")[:OBSERVERS].tolist()


def _lacking(
    found: Counterparts, views: Sequence[_View], d: int, states: States
) -> tuple[float, Stretch, Stretch]:
    values, places = [], []
    for view in views:
        r = found.references[view.row]
        if r == d or not view.usual:
            continue
        at = [_place(found, view.row, d, usual.moment) for usual in view.usual]
        lacks = np.array(
            [u.lack(change_at(states, place)) for u, place in zip(view.usual, at, strict=True)]
        )
        # What is lacked at one moment alone is a hand that passed.
        lasting = np.minimum(lacks, np.append(lacks[1:], lacks[-1:]))
        values.append(float(np.sort(lasting)[-MOMENTS:].mean()))
        worst = int(lasting.argmax())
        places.append((_about(found, d, at[worst]), _about(found, r, view.usual[worst].moment)))
    if not values:
        nowhere = Stretch(d, 0, found.lengths[d])
        return 0.0, nowhere, nowhere
    chosen = int(np.argsort(values, kind="stable")[len(values) // 2])
    return float(np.median(values)), *places[chosen]


def _place(found: Counterparts, row: int, d: int, moment: int) -> int:
    match = found.there[row][d]
    return moment if match is None else int(match.at[moment])


def _about(found: Counterparts, video: int, moment: int) -> Stretch:
    return Stretch(video, max(moment - REACH, 0), min(moment + REACH + 1, found.lengths[video]))


def _amounts(
    change: Array, rows: NDArray[np.int64], columns: NDArray[np.int64], directions: Array
) -> Array:
    """Return (C,): the most of the change in each direction that lies near its cell."""
    reach = range(-NEIGHBOURHOOD, NEIGHBOURHOOD + 1)
    height, width = change.shape[:2]
    near_rows = np.clip(rows + np.repeat(reach, len(reach))[:, None], 0, height - 1)
    near_columns = np.clip(columns + np.tile(reach, len(reach))[:, None], 0, width - 1)
    return np.asarray((change[near_rows, near_columns] * directions).sum(axis=2).max(axis=0))
