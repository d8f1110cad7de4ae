"""What is usual at each moment of a reference, and how far a demonstration departs from it."""

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import ROUND_TRIP, Counterparts, Match, placed, unless_again
from filtering.moments.evidence.stretches import worst
from filtering.moments.peers.peers import Flags, Peers

Array = NDArray[np.float64]

VARIETY = 0.3
"""Share of the trusted videos, rounded up, that makes a behaviour one of several usual ones."""
RECOGNISED = 1.2
"""Largest log of how much farther than usual a counterpart may be for its place to count: what is
done at another place is done among other things."""
LEAST_SURE = 0.5
"""Share of a video by which passed moments are divided at least: where only a few moments are sure,
they tell little."""
FEWEST = 2
"""Least number of videos that say what is usual, beside a reference and who is judged."""


def references_of(found: Counterparts, peers: Peers) -> "list[Reference]":
    """Return what is usual among the trusted, seen from each reference.

    Args:
        found: the counterparts.
        peers: who says what is usual for whom.
    """
    return [Reference(found, row, peers) for row in range(len(found.references))]


def rows_of(found: Counterparts, peers: Peers) -> list[int]:
    """Return the rows of the trusted references; of all where too few are trusted."""
    rows = [row for row, r in enumerate(found.references) if peers.trusted[r]]
    return rows if len(rows) >= FEWEST else list(range(len(found.references)))


def moved(at: NDArray[np.int64], sure: NDArray[np.bool_]) -> Array:
    """Return (n,): the share of the sure moments that each moment has passed in the other video.

    That are the moments that came before it and come after it in the other, or the other way round.
    Tempo, rests and what is left out elsewhere change nothing about it.

    Args:
        at: (n,) counterparts of the moments.
        sure: (n,) True for counterparts that count; others are passed by nobody and pass nobody.
    """
    moments = np.arange(len(at))
    earlier = moments[:, None] < moments[None, :]
    later = at[:, None] > at[None, :] + ROUND_TRIP
    passed = (earlier & later & sure[:, None]).sum(axis=0)
    passing = (earlier & later & sure[None, :]).sum(axis=1)
    return np.where(sure, (passed + passing) / max(sure.sum(), LEAST_SURE * len(at)), 0.0)


def usual_of(curves: NDArray[np.floating]) -> Array:
    """Return (n,): what a share VARIETY of the demonstrations reaches.

    Args:
        curves: (K, n) of those who say what is usual. A reference and the demonstration that is
            judged are counted in, and do not reach it.
    """
    return np.asarray(np.sort(curves, axis=0)[-_need(len(curves) + 1)], dtype=np.float64)


def usual_of_others(values: Array, members: Flags) -> Array:
    """Return (T, D): for each of D columns what a share VARIETY of the members reaches.

    The column itself is counted in, and does not reach it; where it has no others, it is 0.

    Args:
        values: (T, D).
        members: (D,) True for those who say what is usual.
    """
    ordered = -np.sort(-values[:, members], axis=1)
    count = ordered.shape[1]
    if count == 0:
        return np.zeros_like(values)
    padded = np.pad(ordered, ((0, 0), (0, 1)))
    usual = np.repeat(padded[:, _need(count) - 1, None], values.shape[1], axis=1)
    need = _need(count - 1)
    reaches = values[:, members] >= padded[:, need - 1, None]
    usual[:, members] = np.where(reaches, padded[:, need, None], padded[:, need - 1, None])
    return usual


def _need(others: int) -> int:
    """Return how many others make a share VARIETY, together with the one that is judged."""
    return max(int(np.ceil(VARIETY * (others + 1))) - 1, 1)


class Reference:
    """What is usual at each moment of one reference."""

    def __init__(self, found: Counterparts, row: int, peers: Peers) -> None:
        """Compare the trusted demonstrations with the reference of a row of `found`."""
        self._peers = peers
        self.number = found.references[row]
        rows = rows_of(found, peers)
        self.trusted = row in rows
        """Whether the reference says itself what is usual."""
        self._there, self._back = found.there[row], found.back[row]
        others = [k for other in rows if (k := found.references[other]) != self.number]
        self._rows = {k: place for place, k in enumerate(others)}
        self._lacks = np.stack([self._match(k).contested for k in others])
        self._known: dict[int, Array] = {}

    def speaks_for(self, d: int) -> bool:
        """Return whether it is one of those that say what is usual for d."""
        return self.trusted and bool(self._peers.of(d)[self.number])

    def lack(self, d: int) -> Array:
        """Return (n,): how much farther than usual the counterparts in d are."""
        match = self._match(d)
        return unless_again(match, match.contested - self._usual(self._lacks, d))

    def shift(self, d: int) -> Array:
        """Return (n,): how much farther than usual the moments are moved in d."""
        return np.maximum(self._moved_in(d) - self._usual(self._moved, d), 0.0)

    def move(self, d: int) -> float:
        """Return how far steps move in d, NaN for itself [length of a video]."""
        return np.nan if d == self.number else worst(self._moved_in(d))

    def at(self, d: int) -> NDArray[np.int64]:
        """Return (n,): the counterparts in d."""
        return self._match(d).at

    def _usual(self, curves: NDArray[np.floating], d: int) -> Array:
        """Return (n,): what is usual for d among all trusted demonstrations or those of its look.

        Args:
            curves: (K, n) of the trusted ones, in the order of `_rows`.
            d: who is judged.
        """
        others = {k: place for k, place in self._rows.items() if k != d}
        alike = self._peers.alike(d)
        near = [place for k, place in others.items() if alike[k]]
        usual = usual_of(curves[list(others.values()) or [0]])
        if 0 < len(near) < len(others):
            usual = np.maximum(usual, usual_of(curves[near]))
        return usual

    @cached_property
    def _moved(self) -> Array:
        """(K, n) how far the moments are moved in each other trusted demonstration."""
        return np.stack([self._moved_in(k) for k in self._rows])

    @cached_property
    def _median(self) -> NDArray[np.floating]:
        return np.asarray(np.median(self._lacks, axis=0))

    def _moved_in(self, d: int) -> Array:
        """Return (n,): how far the moments are moved in d."""
        if d not in self._known:
            match, back = self._match(d), self._back[d]
            assert back is not None
            near = match.contested - self._median < RECOGNISED
            self._known[d] = moved(match.at, near & placed(match, back))
        return self._known[d]

    def _match(self, d: int) -> Match:
        match = self._there[d]
        assert match is not None
        return match
