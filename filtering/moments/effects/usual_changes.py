"""What changes about a moment in most videos, and how much of it one of them shows.

At moment t of a reference and at its counterpart in every video, what lies in each cell is compared
before and after, x_k(t): cells REACH moments later minus REACH moments earlier. Hands and arms pass
by, so that a median over a few moments takes them out. m(t), the median of x_k over the videos, is
what usually changes here. A video has of it

    p_k = max over the neighbourhood of the cell of <x_k, m> / |m| and OTHER_COLOUR |x_k|,

in a neighbourhood because things do not lie exactly where they lay; pictures in which all changes
lie elsewhere are shifted as a whole before that, see `viewpoints`. What changes into another colour
counts for less: a hand of another skin or sleeve does the same. Of a usual amount q the share that
is not there is

    (q - p_k) / (q + NOISE),

and its mean over the CELLS_SHARE of cells that lack most is what a video lacks of the change. Only
changes that most videos show in the same cells count, and none that recurs there, see `recurring`.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts
from filtering.moments.effects.changes import (
    CELLS,
    REACH,
    Change,
    States,
    change_about,
    change_at,
    lasting_sizes,
    later_about,
)
from filtering.moments.effects.recurring import recurrences
from filtering.moments.peers.peers import Flags

Array = NDArray[np.float64]
Amounts = NDArray[np.float32]
"""(..., C) how much of a usual change is there, 0..255."""

STRIDE = 2
"""Every second moment is looked at."""
NEIGHBOURHOOD = 2
"""How far a thing may lie from where it usually does [cells]."""
NOISE = 20.0
"""Added to the usual change of a cell: small changes cannot be lacking altogether, 0..255."""
MOST_CELLS = 300
"""Most cells looked at at a moment, those that change most."""
CELLS_SHARE = 0.25
"""Share of the cells that change, CELLS or more, whose mean counts, those that lack most."""
OTHER_COLOUR = 0.4
"""How much of a change into another colour counts as a usual change."""
OTHER_NEIGHBOURHOOD = 1
"""How far such a change may lie from where it usually does [cells]."""
MOMENTS = 3
"""The mean of so many moments, those that lack most, counts."""
MOST_RECURRENCES = 2
"""Most times that a change may come about in a reference: a hand comes back to where it rests after
every step."""


@dataclass(frozen=True)
class Usual:
    """What usually changes about one moment of one reference."""

    moment: int
    """The moment."""
    rows: NDArray[np.int64]
    """(C,) rows of the cells that change."""
    columns: NDArray[np.int64]
    """(C,) their columns."""
    shape: tuple[int, int]
    """Height and width of the picture [cells]."""
    directions: Change
    """(C, 3) colour direction in which each changes, of length 1."""

    def amounts(self, change: Change) -> Amounts:
        """Return (C,): how much of it a change (H, W, 3) shows."""
        near = change.reshape(-1, 3).take(self._near, axis=0)
        along = np.einsum("kci,ci->kc", near, self.directions).max(axis=0)
        close = near[: (2 * OTHER_NEIGHBOURHOOD + 1) ** 2]
        otherwise = np.sqrt(np.einsum("kci,kci->kc", close, close).max(axis=0))
        return np.maximum(along, OTHER_COLOUR * otherwise)

    @cached_property
    def _near(self) -> NDArray[np.int64]:
        """(K, C) numbers of the cells in the neighbourhood of each, the nearest ones first."""
        height, width = self.shape
        reach = range(-NEIGHBOURHOOD, NEIGHBOURHOOD + 1)
        offsets = sorted(product(reach, reach), key=lambda offset: max(map(abs, offset)))
        down, right = np.array(offsets).T[:, :, None]
        near_rows = np.clip(self.rows + down, 0, height - 1)
        near_columns = np.clip(self.columns + right, 0, width - 1)
        return np.asarray(near_rows * width + near_columns)

    def most(self, states: States, spans: Iterable[tuple[int, int]]) -> Amounts:
        """Return (C,): the most of it that a video shows between the moments of any span."""
        changes = (change_at(states, *span) for span in spans)
        return np.asarray(np.max([self.amounts(change) for change in changes], axis=0))

    def but(self, left_out: Flags) -> "Usual | None":
        """Return what usually changes but in some of the (C,) cells; None if that is little."""
        kept = ~left_out
        if kept.sum() < CELLS:
            return None
        rows, columns, directions = self.rows[kept], self.columns[kept], self.directions[kept]
        return Usual(self.moment, rows, columns, self.shape, directions)

    def unless_recurring(self, states: States) -> "Usual | None":
        """Return what comes about at most MOST_RECURRENCES times in the video that shows it."""
        places = states[:, self.rows, self.columns]
        return self.but(recurrences(places, self.moment, REACH) > MOST_RECURRENCES)


def usual_change(
    moment: int, changes: Change, later: Change, most: int = MOST_CELLS
) -> Usual | None:
    """Return what most videos change, and do not change back; None if that is little.

    Args:
        moment: the moment of the reference.
        changes: (D, H, W, 3) changes of the videos about it.
        later: (D, H, W, 3) their changes between moments farther before and after.
        most: most cells looked at, those that change most.
    """
    median, lasting = np.median(changes, axis=0), np.median(later, axis=0)
    sizes = lasting_sizes(median, lasting)
    flat = np.argsort(-sizes.ravel(), kind="stable")[:most]
    flat = flat[sizes.ravel()[flat] > 0]
    if len(flat) < CELLS:
        return None
    rows, columns = np.unravel_index(flat, sizes.shape)
    directions = median[rows, columns] / sizes[rows, columns][:, None]
    shape = (sizes.shape[0], sizes.shape[1])
    return Usual(moment, rows, columns, shape, directions.astype(np.float32))


def usual_changes(found: Counterparts, row: int, states: Mapping[int, States]) -> list[Usual]:
    """Return what most videos change about the moments of the reference of a row of `found`.

    Args:
        found: the counterparts.
        row: row of the reference.
        states: per number of a reference what lies where, from the viewpoint of that one.
    """
    usual, reference = [], states[found.references[row]]
    for moment in range(0, len(reference), STRIDE):
        changes = [change_about(own, found, row, k, moment) for k, own in states.items()]
        later = [later_about(own, found, row, k, moment) for k, own in states.items()]
        known = usual_change(moment, np.stack(changes), np.stack(later))
        if known is not None and (kept := known.unless_recurring(reference)) is not None:
            usual.append(kept)
    return usual


def share_lacking(amounts: NDArray[np.floating], usual: NDArray[np.floating]) -> Array:
    """Return (...): the share of a usual change that is not there, in the cells that lack most.

    Args:
        amounts: (..., C) how much of it is there.
        usual: (C,) how much of it there is usually.
    """
    lacking = (usual - amounts) / (np.maximum(usual, 0.0) + NOISE)
    most = max(CELLS, int(CELLS_SHARE * lacking.shape[-1]))
    return np.asarray(np.sort(lacking, axis=-1)[..., -most:].mean(axis=-1))
