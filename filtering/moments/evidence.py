"""What counterparts say against a demonstration: a stretch is missing, out of order or extra.

With near_rd(t) the distance of the counterpart in video d of moment t of reference r, at_rd(t) its
place, moved_rd(t) the share of the video that it has passed, and Q_k the quantile 1 - VARIETY over
the other references k, trusted ones alone:

    missing    log near_rd(t) - Q_k log near_rk(t)
    order      moved_rd(t) - Q_k moved_rk(t)
    extra      log near_dr(t) - median_k log near_rk(at_dr(t))         of moments t of d itself

Order counts only where the counterpart of the counterpart is the moment itself: rests look all
alike. What a share VARIETY of the videos does, an optional step left out or another legal order, is
thus never evidence. Each curve is summed up by the mean of its largest twelfth over t, because a
step is a part of a video; missing and order by the median over the references, because a reference
may be incorrect too; extra by the quantile SHARED. Missing and extra count less the more of the
stretch is replaced, see `replaced`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import ROUND_TRIP, Counterparts, returned
from filtering.moments.replaced import Side, replaced

Array = NDArray[np.float64]
Trusted = NDArray[np.bool_]
"""(D,) True for the demonstrations that say what is usual."""

VARIETY = 0.3
"""Share of the trusted videos that makes a behaviour one of several usual ones."""
RECOGNISED = 1.2
"""Largest log of how much farther than usual a counterpart may be for its place to count: what is
done at another place is done among other things."""
SHARED = 0.2
"""Share of the trusted videos that makes a step one of the task: one that fewer show is extra."""
MOST_PAIRS = 0.6
"""Share of the pairs of demonstrations by which it is told how free orders are: in a pool of ten
demonstrations of one order and four of another, 0.56 of the pairs agree."""
SMALL_MOVE = 0.02
"""Least move of a step that changes the order [length of a video]."""
WORST = 12
"""The worst 1 / WORST of a video counts."""
TINY = 1e-6
"""Keeps logarithms finite where two videos are the same."""


@dataclass(frozen=True)
class Stretch:
    """Where evidence comes from: moments of a video that shows what it is about."""

    video: int
    """Number of the video."""
    start: int
    """First moment."""
    stop: int
    """Moment after the last one."""


@dataclass(frozen=True)
class Evidence:
    """One kind of evidence against each of D demonstrations."""

    values: Array
    """(D,) how much, higher is worse."""
    own: tuple[Stretch, ...]
    """Per demonstration where in itself it shows."""
    other: tuple[Stretch, ...]
    """Per demonstration where in another video that which it is about is seen."""


def references_of(found: Counterparts, trusted: Trusted) -> "list[Reference]":
    """Return what is usual, seen from each trusted reference.

    Args:
        found: the counterparts.
        trusted: (D,) True for the demonstrations that say what is usual.
    """
    return [Reference(found, row, trusted) for row in rows_of(found, trusted)]


def missing_order_extra(
    found: Counterparts, references: "Sequence[Reference]"
) -> tuple[Evidence, Evidence, Evidence]:
    """Return the evidence of the three kinds, in the order of the name.

    Args:
        found: the counterparts.
        references: what is usual.
    """
    results = [
        _Comparison([r for r in references if r.number != d], d) for d in range(len(found.lengths))
    ]
    return (
        _evidence([one.missing() for one in results]),
        _evidence([one.order() for one in results]),
        _evidence([one.extra() for one in results]),
    )


def moves_between(references: "Sequence[Reference]") -> Array:
    """Return (P,): per pair of trusted demonstrations how far steps move [length of a video]."""
    return np.array([far for reference in references for far in reference.moves()])


def variety_of(moves: Array) -> float:
    """Return how far steps move from one demonstration to another [length of a video].

    It is 0 while most pairs of demonstrations keep one order.

    Args:
        moves: (P,) see `moves_between`.
    """
    return float(np.quantile(moves, MOST_PAIRS))


def share_of_one_order(moves: Array) -> float:
    """Return the share of the pairs of demonstrations that keep one order; see `variety_of`."""
    return float((moves < SMALL_MOVE).mean())


def rows_of(found: Counterparts, trusted: Trusted) -> list[int]:
    """Return the rows of the trusted references; of all where fewer than two are trusted."""
    rows = [row for row, r in enumerate(found.references) if trusted[r]]
    return rows if len(rows) >= 2 else list(range(len(found.references)))


def moved(at: NDArray[np.int64], sure: NDArray[np.bool_]) -> Array:
    """Return (n,): the share of a video that each moment has passed in the other video.

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
    return np.where(sure, (passed + passing) / len(at), 0.0)


def worst(curve: NDArray[np.floating]) -> float:
    """Return the mean of the largest twelfth of a curve (n,), of 3 values or more."""
    count = min(len(curve), max(3, len(curve) // WORST))
    return float(np.sort(curve)[-count:].mean())


def peak(curve: NDArray[np.floating]) -> tuple[int, int]:
    """Return the stretch (start, stop) about the largest value in which a curve is half as high.

    The curve is averaged over a twelfth of its length first.
    """
    width = max(3, len(curve) // WORST)
    smooth = np.convolve(np.pad(curve, width // 2, mode="edge"), np.ones(width) / width, "valid")
    smooth = smooth[: len(curve)]
    top = int(smooth.argmax())
    low = np.flatnonzero(smooth < (smooth[top] + np.median(smooth)) / 2)
    start = int(low[low < top].max(initial=-1)) + 1
    stop = int(low[low > top].min(initial=len(curve)))
    return start, stop


class Reference:
    """What is usual among the trusted at each moment of one reference."""

    def __init__(self, found: Counterparts, row: int, trusted: Trusted) -> None:
        """Compare the trusted demonstrations with the reference of a row of `found`."""
        self.number = found.references[row]
        self._matches, self._back = found.there[row], found.back[row]
        others = [found.references[other] for other in rows_of(found, trusted)]
        self._others = [k for k in others if k != self.number]
        matches = [self._matches[k] for k in self._others]
        self._nears = np.stack([np.log(m.near + TINY) for m in matches if m is not None])
        self.usual: Array = np.median(self._nears, axis=0)
        self._moved = np.stack([self._moved_in(k) for k in self._others])
        self._rows = {k: row for row, k in enumerate(self._others)}

    def departures(self, d: int) -> tuple[Array, Array]:
        """Return (n,), (n,): how much farther than usual, and how much displaced, d shows it."""
        match = self._matches[d]
        assert match is not None
        kept = [row for row, k in enumerate(self._others) if k != d] or [0]
        lack = np.log(match.near + TINY) - np.quantile(self._nears[kept], 1 - VARIETY, axis=0)
        usual = np.quantile(self._moved[kept], 1 - VARIETY, axis=0)
        own = self._moved[self._rows[d]] if d in self._rows else self._moved_in(d)
        return lack, np.maximum(own - usual, 0.0)

    def _moved_in(self, d: int) -> Array:
        match, back = self._matches[d], self._back[d]
        assert match is not None
        assert back is not None
        near = np.log(match.near + TINY) - self.usual < RECOGNISED
        return moved(match.at, near & returned(match, back, ROUND_TRIP))

    def moves(self) -> list[float]:
        """Return how far steps move in each other trusted demonstration."""
        return [worst(moved) for moved in self._moved]

    def at(self, d: int) -> NDArray[np.int64]:
        """Return (n,): the counterparts in d."""
        match = self._matches[d]
        assert match is not None
        return match.at

    def back(self, d: int) -> Side:
        """Return how much farther than usual the moments of d have their counterparts here."""
        match = self._back[d]
        assert match is not None
        return Side(np.log(match.near + TINY) - self.usual[match.at], match.at)


_Result = tuple[float, Stretch, Stretch]


class _Comparison:
    """A demonstration compared with all references."""

    def __init__(self, references: Sequence[Reference], d: int) -> None:
        self._references, self._d = references, d
        pairs = [reference.departures(d) for reference in references]
        self._lacks, self._shifts = [lack for lack, _ in pairs], [shift for _, shift in pairs]
        self._sides = [reference.back(d) for reference in references]
        self._curve: Array = np.quantile([side.curve for side in self._sides], SHARED, axis=0)

    def missing(self) -> _Result:
        values = [
            less(worst(lack), replaced(Side(lack, r.at(self._d)), self._curve, *peak(lack)))
            for r, lack in zip(self._references, self._lacks, strict=True)
        ]
        return self._middle(values, self._lacks)

    def order(self) -> _Result:
        return self._middle([worst(shift) for shift in self._shifts], self._shifts)

    def extra(self) -> _Result:
        start, stop = peak(self._curve)
        shares = [
            replaced(Side(self._curve, side.at), lack, start, stop)
            for side, lack in zip(self._sides, self._lacks, strict=True)
        ]
        value = less(worst(self._curve), float(np.median(shares)))
        nearest = int(np.argmin([side.curve[start:stop].mean() for side in self._sides]))
        places = self._sides[nearest].at[start:stop]
        other = Stretch(self._references[nearest].number, int(places.min()), int(places.max()) + 1)
        return value, Stretch(self._d, start, stop), other

    def _middle(self, values: Sequence[float], curves: Sequence[Array]) -> _Result:
        """Sum up the values of all references; the places are those of the median one."""
        chosen = int(np.argsort(values, kind="stable")[len(values) // 2])
        start, stop = peak(curves[chosen])
        places = np.sort(self._references[chosen].at(self._d)[start:stop])
        low, high = np.quantile(places, (0.25, 0.75)).astype(int)
        own = Stretch(self._d, int(low), int(high) + 1)
        return float(np.median(values)), own, Stretch(self._references[chosen].number, start, stop)


def less(value: float, share: float) -> float:
    """Return evidence about a stretch of which a share is replaced."""
    return value * (1 - share) if value > 0 else value


def _evidence(results: Sequence[_Result]) -> Evidence:
    values, own, other = zip(*results, strict=True)
    return Evidence(np.array(values), tuple(own), tuple(other))
