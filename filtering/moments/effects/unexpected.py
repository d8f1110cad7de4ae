"""Changes that hardly any other video shows: something was done that is no part of the task.

Where the picture of a demonstration changes for good about its moment t, the references are looked
at about their counterparts of t. What one of them lacks of that change, see `usual_changes`, is
near 0 where the same comes about in it, and near 1 where nothing changes there. What a share SHARED
of the references lacks at least counts, because what so many do is one way to do the task. Where
things lie elsewhere in every video, all changes are unlike those of others, and nobody is accused
by it: evidence counts by how far it lies above that of the others. Another hand changes the picture
where it rests, so that only references with the same actor are asked.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts, Match, spread
from filtering.moments.effects.changes import (
    LATER,
    REACH,
    States,
    change_at,
    ends_about,
    stretch_about,
)
from filtering.moments.effects.usual_changes import MOMENTS, Usual, share_lacking, usual_change
from filtering.moments.evidence.strange import SHARED
from filtering.moments.evidence.stretches import Evidence, Stretch, mean_of_largest
from filtering.moments.evidence.usual import FEWEST
from filtering.moments.peers.peers import Looks

Array = NDArray[np.float64]

MOST_CELLS = 100
"""Most cells looked at at a moment, those that change most, so that it takes little time."""
STRIDE = 4
"""Every fourth moment is looked at: a change is seen from REACH moments before to as many after."""
MOST_COMPARED = 12
"""Most references that a demonstration is compared with, about those of a small pool: each takes
time."""


class Unexpected(NamedTuple):
    """The change of a demonstration that others lack most."""

    value: float
    """How much of it they lack, 0 to 1."""
    own: Stretch
    """Where it comes about."""
    other: Stretch
    """The same place in the video that lacks it most."""


def unexpected(found: Sequence[Unexpected]) -> Evidence:
    """Return the evidence that each demonstration changes what hardly any other does."""
    values, own, other = zip(*found, strict=True)
    return Evidence(np.array(values), tuple(own), tuple(other))


def unexpected_in(
    found: Counterparts, placed: Mapping[int, States], d: int, own: States, actors: Looks
) -> Unexpected:
    """Return what the references with the same actor lack of the changes of demonstration d.

    Args:
        found: the counterparts.
        placed: per number of a reference what lies where, all from one viewpoint.
        d: number of the demonstration.
        own: what lies where in it, from the same viewpoint.
        actors: (D,) the same number for demonstrations with the same actor.
    """
    same = [r != d and actors[r] == actors[d] for r in found.references]
    rows = spread(np.flatnonzero(same).tolist(), MOST_COMPARED)
    changes = list(_changes_of(own))
    if not changes or len(rows) < FEWEST:
        nowhere = Stretch(d, 0, found.lengths[d])
        return Unexpected(0.0, nowhere, nowhere)
    matches = [_match(found, row, d) for row in rows]
    others = [placed[found.references[row]] for row in rows]
    shares = np.stack([_lacked(change, own, matches, others) for change in changes])
    lacking = np.quantile(shares, SHARED, axis=1)
    chosen = int(lacking.argmax())
    moment, without = changes[chosen].moment, int(shares[chosen].argmax())
    # What changes at fewer than MOMENTS moments counts in part.
    padded = np.append(lacking, np.zeros(MOMENTS))
    return Unexpected(
        mean_of_largest(padded, MOMENTS),
        stretch_about(found, d, moment),
        stretch_about(found, found.references[rows[without]], int(matches[without].at[moment])),
    )


def _changes_of(own: States) -> Iterator[Usual]:
    """Yield what changes for good about every STRIDE-th moment of one video."""
    for moment in range(0, len(own), STRIDE):
        change = change_at(own, moment - REACH, moment + REACH)
        later = change_at(own, moment - LATER * REACH, moment + LATER * REACH)
        known = usual_change(moment, change[None], later[None], most=MOST_CELLS)
        if known is not None and (kept := known.unless_recurring(own)) is not None:
            yield kept


def _lacked(
    change: Usual, own: States, matches: Sequence[Match], others: Sequence[States]
) -> Array:
    """Return (K,): the share of a change of a video that each of K others lacks."""
    moment = change.moment
    usual = change.amounts(change_at(own, moment - REACH, moment + REACH))
    amounts = [
        change.most(states, _spans(match, moment))
        for match, states in zip(matches, others, strict=True)
    ]
    return share_lacking(np.stack(amounts), usual)


def _spans(match: Match, moment: int) -> Iterator[tuple[int, int]]:
    """Yield the spans in which the same change may come about in another video."""
    for at in {int(match.at[moment]), int(match.nearest[moment])}:
        yield at - REACH, at + REACH
    before, after = ends_about(moment, LATER * REACH, len(match.at))
    yield int(match.at[before]), int(match.at[after])


def _match(found: Counterparts, row: int, d: int) -> Match:
    match = found.back[row][d]
    assert match is not None
    return match
