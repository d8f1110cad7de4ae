"""Steps of which nothing came: what usually changes in the picture, and did not.

At moment t of a reference and at its counterpart in every video, what lies in each cell is compared
before and after, x_k(t): cells REACH moments later minus REACH moments earlier. Hands and arms pass
by, so that a median over a few moments takes them out. m(t), the median of x_k over the videos, is
what usually changes here. A video has of it

    p_k = max over the neighbourhood of the cell of <x_k, m> / |m| and OTHER_COLOUR |x_k|,

in a neighbourhood because things do not lie exactly where they lay; pictures in which all changes
lie elsewhere are shifted as a whole before that, see `viewpoints`. What changes into another colour
counts for less: a hand of another skin or sleeve is not a step without effect. With q the median of
p over the trusted videos, the share that is not there is

    (q - p_k) / (q + NOISE),

1 where nothing came of it and near 0 where it is as usual. Its mean over the CELLS_SHARE of cells
that lack most becomes the logarithm of the share that is there. What a share VARIETY of the trusted
videos lacks at the same moment, because the step is optional, hands cover it or things lie
elsewhere, is taken off, and what as many of those with the same actor lack. Only changes that most
videos show in the same cells count, and none that recurs there, see `recurring`: what is carried
from a place of its own to a common place is missed there. Windows of moments say where to look, so
any order of steps will do.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from filtering.moments.counterparts import Counterparts, how_far
from filtering.moments.evidence.changes import (
    CELLS,
    LATER,
    REACH,
    Change,
    States,
    around,
    change_about,
    change_at,
    lasting_sizes,
    later_about,
    place_of,
    states_of,
)
from filtering.moments.evidence.recurring import recurrences
from filtering.moments.evidence.stretches import Evidence, Stretch, mean_of_largest
from filtering.moments.evidence.usual import usual_of_others
from filtering.moments.evidence.viewpoints import Viewpoint
from filtering.moments.peers.colours import actors_of
from filtering.moments.peers.peers import FEWEST, Flags, Looks, Peers
from filtering.moments.vectors import Video

Array = NDArray[np.float64]
Amounts = NDArray[np.float32]
"""(..., C) how much of a usual change is there, 0..255."""

DOUBTFUL = 6
"""Moments by which the counterpart of a counterpart may miss where it began, or else nothing is
said about the change."""
STRIDE = 2
"""Every second moment is looked at."""
OBSERVERS = 3
"""References from which is told where to look, the most central ones."""
NEIGHBOURHOOD = 2
"""How far a thing may lie from where it usually does [cells]."""
NOISE = 20.0
"""Added to the usual change of a cell: small changes cannot be lacking altogether, 0..255."""
LEAST_SHARE = 0.1
"""Least share of a change that is told apart from none."""
MOST_CELLS = 300
"""Most cells looked at at a moment, those that change most."""
CELLS_SHARE = 0.25
"""Share of the cells that change, CELLS or more, whose mean counts, those that lack most."""
OTHER_COLOUR = 0.4
"""How much of a change into another colour counts as a usual change."""
OTHER_NEIGHBOURHOOD = 1
"""How far such a change may lie from where it usually does [cells]."""
MOST_RECURRENCES = 2
"""Most times that a change may come about in a reference: a hand comes back to where it rests after
every step."""
LASTING = 3
"""Moments that were looked at, one after the other, at which something must be lacking."""
MOMENTS = 3
"""The mean of so many moments counts."""
ABOUT = 5
"""So many moments that were looked at are about the same time: counterparts of what another actor
does are less precise."""


@dataclass(frozen=True)
class Usual:
    """What usually changes about one moment of one reference."""

    moment: int
    """The moment."""
    rows: NDArray[np.int64]
    """(C,) rows of the cells that change."""
    columns: NDArray[np.int64]
    """(C,) their columns."""
    directions: Change
    """(C, 3) colour direction in which each changes, of length 1."""

    def amounts(self, change: Change) -> Amounts:
        """Return (C,): how much of it a change (H, W, 3) shows."""
        reach = np.arange(-NEIGHBOURHOOD, NEIGHBOURHOOD + 1)
        down, right = np.repeat(reach, len(reach)), np.tile(reach, len(reach))
        height, width = change.shape[:2]
        near_rows = np.clip(self.rows + down[:, None], 0, height - 1)
        near_columns = np.clip(self.columns + right[:, None], 0, width - 1)
        near = change[near_rows, near_columns]
        along = (near * self.directions).sum(axis=2).max(axis=0)
        close = np.maximum(abs(down), abs(right)) <= OTHER_NEIGHBOURHOOD
        otherwise = np.linalg.norm(near[close], axis=2).max(axis=0)
        return np.asarray(np.maximum(along, OTHER_COLOUR * otherwise), dtype=np.float32)

    def but(self, left_out: Flags) -> "Usual | None":
        """Return what usually changes but in some of the (C,) cells; None if that is little."""
        kept = ~left_out
        if kept.sum() < CELLS:
            return None
        return Usual(self.moment, self.rows[kept], self.columns[kept], self.directions[kept])


@dataclass(frozen=True)
class View:
    """What usually changes from the viewpoint of one reference, and how much in each video."""

    row: int
    """Row of the reference."""
    usual: tuple[Usual, ...]
    """What usually changes, in order of time; one or more."""
    amounts: tuple[Amounts, ...]
    """(D, C) of each: how much of it each of D videos shows, NaN where that is doubtful."""

    def lacks(self, peers: Peers) -> Array:
        """Return (T, D): how much less each video shows of each change than others do.

        It is a logarithm of shares, 0 where a video shows what is usual, or where it has too few
        trusted others of its look: nobody knows what comes of a step that another actor does.
        """
        shares = np.stack([_share_lacking(amounts, peers.trusted) for amounts in self.amounts])
        # Where it is doubtful what a video shows, neither it nor another is accused by it.
        own, others = (_lacks(np.nan_to_num(shares, nan=doubt)) for doubt in (0.0, 1.0))
        usual = usual_of_others(others, peers.trusted)
        looks = np.unique(peers.looks)
        if len(looks) == 1:
            return np.asarray(own - usual)
        about = maximum_filter1d(others, ABOUT, axis=0)
        for look in looks:
            members = peers.looks == look
            trusted = members & peers.trusted
            alike = usual_of_others(about, trusted)[:, members]
            nobody = trusted.sum() - trusted[members] < FEWEST - 1
            among = np.maximum(usual[:, members], alike)
            usual[:, members] = np.where(nobody, own[:, members], among)
        return np.asarray(own - usual)


@dataclass(frozen=True)
class Effects:
    """What one camera sees of what D demonstrations bring about."""

    views: tuple[View, ...]
    """What usually changes, from the viewpoints of the most central references."""
    actors: Looks
    """(D,) the same number where what moves has the same colours."""


def ineffective(found: Counterparts, views: Sequence[View], peers: Peers) -> Evidence:
    """Return the evidence that nothing came of a step of each demonstration."""
    lacks = [view.lacks(peers) for view in views]
    results = [_lacking(found, views, lacks, d) for d in range(len(found.lengths))]
    values, own, other = zip(*results, strict=True)
    return Evidence(np.array(values), tuple(own), tuple(other))


def observe(found: Counterparts, videos: Sequence[Video]) -> Effects:
    """Return what usually changes, and in which videos the same actor brings it about."""
    states = {r: states_of(videos[r]) for r in found.references}
    viewpoints = [Viewpoint(found, row, states[found.references[row]]) for row in _central(found)]
    seen = [{r: one.placed(r, own) for r, own in states.items()} for one in viewpoints]
    usual = [_usual_changes(found, v.row, s) for v, s in zip(viewpoints, seen, strict=True)]
    amounts: list[list[list[Amounts]]] = [[] for _ in viewpoints]
    for d, video in enumerate(videos):
        other = None if d in states else states_of(video)
        for place, viewpoint in enumerate(viewpoints):
            there = seen[place][d] if other is None else viewpoint.placed(d, other)
            shown = [_amounts(u, there, found, viewpoint.row, d) for u in usual[place]]
            amounts[place].append(shown)
    views = [
        View(viewpoint.row, tuple(changes), tuple(map(np.stack, zip(*shown, strict=True))))
        for viewpoint, changes, shown in zip(viewpoints, usual, amounts, strict=True)
        if changes
    ]
    return Effects(tuple(views), actors_of(videos))


def usual_change(moment: int, changes: Change, later: Change) -> Usual | None:
    """Return what most videos change, and do not change back; None if that is little.

    Args:
        moment: the moment of the reference.
        changes: (D, H, W, 3) changes of the videos about it.
        later: (D, H, W, 3) their changes between moments farther before and after.
    """
    median, lasting = np.median(changes, axis=0), np.median(later, axis=0)
    sizes = lasting_sizes(median, lasting)
    flat = np.argsort(-sizes.ravel(), kind="stable")[:MOST_CELLS]
    flat = flat[sizes.ravel()[flat] > 0]
    if len(flat) < CELLS:
        return None
    rows, columns = np.unravel_index(flat, sizes.shape)
    directions = median[rows, columns] / sizes[rows, columns][:, None]
    return Usual(moment, rows, columns, directions.astype(np.float32))


def _usual_changes(found: Counterparts, row: int, states: Mapping[int, States]) -> list[Usual]:
    usual, reference = [], states[found.references[row]]
    for moment in range(0, len(reference), STRIDE):
        changes = [change_about(own, found, row, k, moment) for k, own in states.items()]
        later = [later_about(own, found, row, k, moment) for k, own in states.items()]
        known = usual_change(moment, np.stack(changes), np.stack(later))
        if known is not None:
            places = reference[:, known.rows, known.columns]
            known = known.but(recurrences(places, moment, REACH) > MOST_RECURRENCES)
        if known is not None:
            usual.append(known)
    return usual


def _amounts(usual: Usual, own: States, found: Counterparts, row: int, d: int) -> Amounts:
    """Return (C,): the most of a change that a video shows over the spans that are looked at.

    What comes a little sooner or later than elsewhere, or while a hand covers it, is not lacking.
    NaN where the counterpart is doubtful.
    """
    if not _leads_back(found, row, d, usual.moment):
        return np.full(len(usual.rows), np.nan, dtype=np.float32)
    at = place_of(found, row, d, usual.moment)
    before, after = around(found, row, d, usual.moment, LATER * REACH)
    spans = [(b, a) for b in (at - REACH, before) for a in (at + REACH, after)]
    return np.asarray(np.max([usual.amounts(change_at(own, *span)) for span in spans], axis=0))


def _leads_back(found: Counterparts, row: int, d: int, moment: int) -> bool:
    there, back = found.there[row][d], found.back[row][d]
    if there is None or back is None:
        return True
    return bool(abs(back.at[there.at[moment]] - moment) <= DOUBTFUL)


def _share_lacking(amounts: Amounts, trusted: Flags) -> Array:
    """Return (D,): share of a usual change that is not there, in the cells that lack most.

    NaN where it is doubtful; nothing is lacking where it is so in all trusted videos.
    """
    known = ~np.isnan(amounts).any(axis=1)
    if not (known & trusted).any():
        return np.where(known, 0.0, np.nan)
    usual = np.median(amounts[known & trusted], axis=0)
    lacking = (usual - amounts) / (np.maximum(usual, 0.0) + NOISE)
    most = max(CELLS, int(CELLS_SHARE * lacking.shape[1]))
    return np.asarray(np.sort(lacking, axis=1)[:, -most:].mean(axis=1))


def _lacks(shares: Array) -> Array:
    """Return (T, D): logarithms of shares that are lacking for a while."""
    # What is lacked for less is a hand that passed, or a counterpart a little off.
    padded = np.pad(shares, ((0, LASTING - 1), (0, 0)), mode="edge")
    lasting = np.min([padded[k : k + len(shares)] for k in range(LASTING)], axis=0)
    return np.asarray(-np.log(1 + LEAST_SHARE - np.clip(lasting, 0.0, 1.0)))


def _central(found: Counterparts) -> list[int]:
    """Return the rows of the most central references."""
    far = [how_far(row) for row in found.there]
    return np.argsort(far, kind="stable")[:OBSERVERS].tolist()


def _lacking(
    found: Counterparts, views: Sequence[View], lacks: Sequence[Array], d: int
) -> tuple[float, Stretch, Stretch]:
    values, places = [], []
    for view, lack in zip(views, lacks, strict=True):
        r = found.references[view.row]
        if r == d:
            continue
        values.append(mean_of_largest(lack[:, d], MOMENTS))
        moment = view.usual[int(lack[:, d].argmax())].moment
        at = place_of(found, view.row, d, moment)
        places.append((_about(found, d, at), _about(found, r, moment)))
    if not values:
        nowhere = Stretch(d, 0, found.lengths[d])
        return 0.0, nowhere, nowhere
    chosen = int(np.argsort(values, kind="stable")[len(values) // 2])
    return float(np.median(values)), *places[chosen]


def _about(found: Counterparts, video: int, moment: int) -> Stretch:
    return Stretch(video, max(moment - REACH, 0), min(moment + REACH + 1, found.lengths[video]))
