"""What is seen of the changes in all videos, from the viewpoints of a few references."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from filtering.moments.counterparts import Counterparts, how_far
from filtering.moments.effects.changes import states_of
from filtering.moments.effects.lacking import View, amounts_in
from filtering.moments.effects.unexpected import Unexpected, unexpected_in
from filtering.moments.effects.usual_changes import Amounts, usual_changes
from filtering.moments.effects.viewpoints import Viewpoint
from filtering.moments.peers.colours import actors_of
from filtering.moments.peers.peers import Looks
from filtering.moments.vectors import Video

OBSERVERS = 3
"""References from which is told where to look, the most central ones."""


@dataclass(frozen=True)
class Effects:
    """What one camera sees of what D demonstrations bring about."""

    views: tuple[View, ...]
    """What usually changes, from the viewpoints of the most central references."""
    unexpected: tuple[Unexpected, ...]
    """(D,) what changes in each, and hardly in others, from the first of these viewpoints."""
    actors: Looks
    """(D,) the same number where what moves has the same colours."""


def observe(found: Counterparts, videos: Sequence[Video]) -> Effects:
    """Return what usually changes, and in which videos the same actor brings it about."""
    states = {r: states_of(videos[r]) for r in found.references}
    viewpoints = [Viewpoint(found, row, states[found.references[row]]) for row in _central(found)]
    seen = [{r: one.placed(r, own) for r, own in states.items()} for one in viewpoints]
    usual = [usual_changes(found, v.row, s) for v, s in zip(viewpoints, seen, strict=True)]
    amounts: list[list[list[Amounts]]] = [[] for _ in viewpoints]
    unlike: list[Unexpected] = []
    actors = actors_of(videos)
    for d, video in enumerate(videos):
        other = None if d in states else states_of(video)
        for place, viewpoint in enumerate(viewpoints):
            there = seen[place][d] if other is None else viewpoint.placed(d, other)
            shown = [amounts_in(u, there, found, viewpoint.row, d) for u in usual[place]]
            amounts[place].append(shown)
            if place == 0:
                unlike.append(unexpected_in(found, seen[0], d, there, actors))
    views = [
        View(viewpoint.row, tuple(changes), tuple(map(np.stack, zip(*shown, strict=True))))
        for viewpoint, changes, shown in zip(viewpoints, usual, amounts, strict=True)
        if changes
    ]
    return Effects(tuple(views), tuple(unlike), actors)


def _central(found: Counterparts) -> list[int]:
    """Return the rows of the most central references."""
    far = [how_far(row) for row in found.there]
    return np.argsort(far, kind="stable")[:OBSERVERS].tolist()
