"""Which things and hands a sub-task involves, found in the demonstrations.

Where the other things stand is different in every demonstration and has no effect on how a sub-task
is carried out. A network that sees it learns demonstrations by heart instead. The same is true of
what a resting hand sees of things at rest.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from policies.data.motions import MotionDemo
from policies.learners.joints.steps.inputs import PARTS, POSITION, RELATIVE

MOVED = 0.03
"""A thing or a hand is moved if its position changes by more [m]; less is execution noise."""
CHANGED = 0.1
"""A thing is changed if its angle or one of its contents changes by more [rad, ml or g]."""
NEARBY = 0.10
"""Things are involved that come nearer than this to a thing that is moved or changed [m]."""


@dataclass(frozen=True)
class Bodies:
    """The things and hands that the names of a state tell of."""

    names: tuple[str, ...]
    """Names of the numbers of the state."""

    @property
    def things(self) -> list[str]:
        """What is seen in the frame of a hand."""
        return list(dict.fromkeys(thing for thing, _ in map(viewed, self.names) if thing))

    @property
    def hands(self) -> list[str]:
        """In whose frame things are seen."""
        return list(dict.fromkeys(hand for _, hand in map(viewed, self.names) if hand))

    def way(self, body: str, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the positions (n, 3) of a body in states (n, S); the missing ones are nan."""
        way = np.full((len(seen), len(POSITION)), np.nan, np.float32)
        for column, part in enumerate(POSITION):
            if body + part in self.names:
                way[:, column] = seen[:, self.names.index(body + part)]
        return way

    def contents(self, thing: str) -> list[int]:
        """Return the places of the numbers of a thing that are no part of a pose."""
        mine = [name for name in self.names if name.startswith(f"{thing}_")]
        own = [name for name in mine if RELATIVE not in name and not name.endswith(PARTS)]
        return [self.names.index(name) for name in own]


def viewed(name: str) -> tuple[str, str]:
    """Return the thing and the hand of a number of a view, two empty texts for any other.

    >>> viewed("cup_in_left_hand_qw")
    ('cup', 'left_hand')
    """
    thing, relative, rest = name.partition(RELATIVE)
    part = next((part for part in PARTS if rest.endswith(part)), "")
    return (thing, rest.removesuffix(part)) if relative and part else ("", "")


def involved_bodies(
    demos: Sequence[MotionDemo], names: Sequence[str], subtasks: int
) -> list[set[str]]:
    """Return the things and hands that each of E sub-tasks involves in most demonstrations of it.

    A thing is involved that is moved or changed, or that comes near to such a thing; a hand that is
    moved.
    """
    bodies = Bodies(tuple(names))
    every = [*bodies.things, *bodies.hands]
    votes, counts = np.zeros((subtasks, len(every))), np.zeros((subtasks, 1))
    for demo in demos:
        for subtask in np.unique(demo.subtasks):
            seen = demo.low_dim[demo.subtasks == subtask]
            votes[subtask] += demo.share * _involved(seen, bodies)
            counts[subtask] += demo.share
    chosen = votes > counts / 2
    return [{body for body, is_in in zip(every, row, strict=True) if is_in} for row in chosen]


def relevance(
    sources: Sequence[str], involved: Sequence[set[str]], extra: int
) -> NDArray[np.float32]:
    """Return 1 for each input that a sub-task's network is given and 0 for the others, (E, I).

    Args:
        sources: Names behind the inputs.
        involved: Things and hands that each sub-task involves; without any, all inputs are given.
        extra: Number of further inputs, which all networks are given.
    """
    views = [{body for body in viewed(name) if body} for name in sources]
    table = [[not bodies or view <= bodies for view in views] for bodies in involved]
    given = np.array(table, dtype=np.float32).reshape(len(involved), len(sources))
    return np.hstack([given, np.ones((len(involved), extra), np.float32)])


def _involved(seen: NDArray[np.float32], bodies: Bodies) -> NDArray[np.bool_]:
    """Return which things and hands are involved in what was seen, (T + H,)."""
    ways = [bodies.way(thing, seen) for thing in bodies.things]
    touched = np.array(
        [
            _is_moved(way)
            or np.ptp(seen[:, bodies.contents(thing)], axis=0).max(initial=0) > CHANGED
            for thing, way in zip(bodies.things, ways, strict=True)
        ],
        dtype=np.bool_,
    )
    near = np.zeros_like(touched)
    for place, way in enumerate(ways):
        gaps = [np.linalg.norm(way - ways[k], axis=1) for k in np.flatnonzero(touched)]
        near[place] = any((gap < NEARBY).any() for gap in gaps)
    hands = np.array([_is_moved(bodies.way(hand, seen)) for hand in bodies.hands], dtype=np.bool_)
    return np.concatenate([touched | near, hands])


def _is_moved(way: NDArray[np.float32]) -> bool:
    return bool((np.ptp(way, axis=0) > MOVED).any())
