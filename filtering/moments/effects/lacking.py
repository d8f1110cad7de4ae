"""Steps of which nothing came: what usually changes in the picture, and did not.

What a video lacks of a usual change, see `usual_changes`, is told with the median of p over the
trusted videos as the usual amount q: 1 where nothing came of it and near 0 where it is as usual. It
becomes the logarithm of the share that is there. What a share VARIETY of the trusted videos lacks
at the same moment, because the step is optional, hands cover it or things lie elsewhere, is taken
off, and what as many of those with the same actor lack. What is carried from a place of its own to
a common place is missed there. Windows of moments say where to look, so any order of steps will do.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from filtering.moments.counterparts import Counterparts
from filtering.moments.effects.changes import (
    LATER,
    REACH,
    States,
    around,
    place_of,
    stretch_about,
)
from filtering.moments.effects.usual_changes import MOMENTS, Amounts, Usual, share_lacking
from filtering.moments.evidence.stretches import Evidence, Stretch, mean_of_largest
from filtering.moments.evidence.usual import usual_of_others
from filtering.moments.peers.peers import FEWEST, Flags, Peers

Array = NDArray[np.float64]

DOUBTFUL = 6
"""Moments by which the counterpart of a counterpart may miss where it began, or else nothing is
said about the change."""
LEAST_SHARE = 0.1
"""Least share of a change that is told apart from none."""
LASTING = 3
"""Moments that were looked at, one after the other, at which something must be lacking."""
ABOUT = 5
"""So many moments that were looked at are about the same time: counterparts of what another actor
does are less precise."""


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


def ineffective(found: Counterparts, views: Sequence[View], peers: Peers) -> Evidence:
    """Return the evidence that nothing came of a step of each demonstration."""
    lacks = [view.lacks(peers) for view in views]
    results = [_lacking(found, views, lacks, d) for d in range(len(found.lengths))]
    values, own, other = zip(*results, strict=True)
    return Evidence(np.array(values), tuple(own), tuple(other))


def amounts_in(usual: Usual, own: States, found: Counterparts, row: int, d: int) -> Amounts:
    """Return (C,): the most of a change that a video shows over the spans that are looked at.

    What comes a little sooner or later than elsewhere, or while a hand covers it, is not lacking.
    NaN where the counterpart is doubtful.
    """
    if not _leads_back(found, row, d, usual.moment):
        return np.full(len(usual.rows), np.nan, dtype=np.float32)
    at = place_of(found, row, d, usual.moment)
    before, after = around(found, row, d, usual.moment, LATER * REACH)
    spans = [(b, a) for b in (at - REACH, before) for a in (at + REACH, after)]
    return usual.most(own, spans)


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
    return share_lacking(amounts, np.median(amounts[known & trusted], axis=0))


def _lacks(shares: Array) -> Array:
    """Return (T, D): logarithms of shares that are lacking for a while."""
    # What is lacked for less is a hand that passed, or a counterpart a little off.
    padded = np.pad(shares, ((0, LASTING - 1), (0, 0)), mode="edge")
    lasting = np.min([padded[k : k + len(shares)] for k in range(LASTING)], axis=0)
    return np.asarray(-np.log(1 + LEAST_SHARE - np.clip(lasting, 0.0, 1.0)))


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
        places.append((stretch_about(found, d, at), stretch_about(found, r, moment)))
    if not values:
        nowhere = Stretch(d, 0, found.lengths[d])
        return 0.0, nowhere, nowhere
    chosen = int(np.argsort(values, kind="stable")[len(values) // 2])
    return float(np.median(values)), *places[chosen]
