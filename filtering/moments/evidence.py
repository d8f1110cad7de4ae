"""What counterparts say against a demonstration: a stretch is missing, out of order or extra.

With c_rd(t) the contested log distance of the counterpart in video d of moment t of reference r,
at_rd(t) its place, moved_rd(t) the share of the video that it has passed, Q_k the value that a
share VARIETY of the trusted videos reach, and W_k the quantile WELL over all videos:

    missing    c_rd(t) - Q_k c_rk(t)
    order      moved_rd(t) - Q_k moved_rk(t)
    extra      c_dr(t) - W_k c_rk(at_dr(t))                            of moments t of d itself

Order counts only where the counterpart of the counterpart is the moment itself: rests look all
alike. What a share VARIETY of the videos does, an optional step left out or another legal order, is
thus never evidence. Each curve is summed up by the mean of its largest twelfth over t, because a
step is a part of a video; missing and order by the median over the trusted references, because a
reference may be incorrect too; extra by the quantile SHARED over all of them, so that trust does
not change it. Extra is also found
from plain nearest moments in place of counterparts, and the larger value counts: a step done twice
is seen in contested places alone, and one that nobody else does better in plain ones. Missing and
extra count less the more of the stretch is replaced, see `replaced`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import ROUND_TRIP, Counterparts, Match, returned
from filtering.moments.replaced import Side, replaced

Array = NDArray[np.float64]
Trusted = NDArray[np.bool_]
"""(D,) True for the demonstrations that say what is usual."""

VARIETY = 0.3
"""Share of the trusted videos, rounded up, that makes a behaviour one of several usual ones."""
RECOGNISED = 1.2
"""Largest log of how much farther than usual a counterpart may be for its place to count: what is
done at another place is done among other things."""
SHARED = 0.2
"""Share of the videos that makes a step one of the task: one that fewer show is extra."""
WELL = 0.25
"""Share of the videos in which a moment is found best; what is extra is compared with them."""
AGREED = (0.4, 0.5)
"""Share of the others whose order a demonstration of the better half keeps, from which there is
nearly an order of the task, and from which there is one. Ten demonstrations of one order keep that
of 0.53 of the others beside eight of any orders; in pools of any legal order of the scenes TUNED_ON
it is 0.47 or less, but where a scene has few legal orders."""
FREEST = 0.9
"""Quantile of the moves between demonstrations that tells how free orders are."""
SMALL_MOVE = 0.02
"""Least move of a step that changes the order [length of a video]."""
WORST = 12
"""The worst 1 / WORST of a video counts."""


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
    """Return what is usual among the trusted, seen from each reference.

    Args:
        found: the counterparts.
        trusted: (D,) True for the demonstrations that say what is usual.
    """
    return [Reference(found, row, trusted) for row in range(len(found.references))]


def missing_order_extra(
    references: "Sequence[Reference]", strange: "Sequence[Strange]"
) -> tuple[Evidence, Evidence, Evidence]:
    """Return the evidence of the three kinds, in the order of the name.

    Args:
        references: what is usual.
        strange: per demonstration how strange its moments are, see `strange_in`.
    """
    results = [_Comparison(references, one, d) for d, one in enumerate(strange)]
    return (
        _evidence([one.missing() for one in results]),
        _evidence([one.order() for one in results]),
        _evidence([one.extra() for one in results]),
    )


def moves_between(references: "Sequence[Reference]") -> Array:
    """Return (R, R): how far steps move between trusted references [length of a video].

    NaN on the diagonal. Of the two that look at a pair, the one that sees less move counts.
    """
    trusted = [reference for reference in references if reference.trusted]
    moves = np.full((len(trusted), len(trusted)), np.nan)
    for row, reference in enumerate(trusted):
        far = reference.moves()
        for column, other in enumerate(trusted):
            moves[row, column] = far.get(other.number, np.nan)
    return np.fmin(moves, moves.T)


def variety_of(moves: Array) -> float:
    """Return how far steps move from one demonstration to another [length of a video].

    It is 0 where half of the demonstrations keep an order that half of the others keep too.

    Args:
        moves: (R, R) see `moves_between`.
    """
    kept = np.sort(np.nanmean(_in_one_order(moves), axis=1))
    low, high = AGREED
    free = np.clip((high - kept[len(kept) // 2]) / (high - low), 0.0, 1.0)
    return float(free * np.nanquantile(moves, FREEST))


def share_of_one_order(moves: Array) -> float:
    """Return the share of the pairs of demonstrations that keep one order; see `moves_between`."""
    return float(np.nanmean(_in_one_order(moves)))


def _in_one_order(moves: Array) -> Array:
    """Return (R, R): 1 for pairs that keep one order, 0 for others, NaN where nothing is known."""
    return np.where(np.isnan(moves), np.nan, moves < SMALL_MOVE)


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


def usual_of(curves: NDArray[np.floating]) -> Array:
    """Return (n,): what a share VARIETY of the demonstrations reaches.

    Args:
        curves: (K, n) of those who say what is usual. A reference and the demonstration that is
            judged are counted in, and do not reach it.
    """
    need = int(np.ceil(VARIETY * (len(curves) + 2))) - 1
    return np.asarray(np.sort(curves, axis=0)[-max(need, 1)], dtype=np.float64)


class Reference:
    """What is usual at each moment of one reference."""

    def __init__(self, found: Counterparts, row: int, trusted: Trusted) -> None:
        """Compare the trusted demonstrations with the reference of a row of `found`."""
        self.number = found.references[row]
        rows = rows_of(found, trusted)
        self.trusted = row in rows
        """Whether the reference says itself what is usual."""
        self._there, self._back = found.there[row], found.back[row]
        others = [k for other in rows if (k := found.references[other]) != self.number]
        self._rows = {k: place for place, k in enumerate(others)}
        self._lacks = np.stack([self._match(k).contested for k in others])

    def lack(self, d: int) -> Array:
        """Return (n,): how much farther than usual the counterparts in d are."""
        return self._match(d).contested - usual_of(self._lacks[self._besides(d)])

    def shift(self, d: int) -> Array:
        """Return (n,): how much farther than usual the moments are moved in d."""
        own = self._moved[self._rows[d]] if d in self._rows else self._moved_in(d)
        return np.maximum(own - usual_of(self._moved[self._besides(d)]), 0.0)

    def moves(self) -> dict[int, float]:
        """Return how far steps move in each other trusted demonstration, by its number."""
        return {k: worst(self._moved[place]) for k, place in self._rows.items()}

    def at(self, d: int) -> NDArray[np.int64]:
        """Return (n,): the counterparts in d."""
        return self._match(d).at

    def _besides(self, d: int) -> list[int]:
        """Return the rows of the trusted demonstrations that d is compared with."""
        return [place for k, place in self._rows.items() if k != d] or [0]

    @cached_property
    def _moved(self) -> Array:
        """(K, n) how far the moments are moved in each other trusted demonstration."""
        return np.stack([self._moved_in(k) for k in self._rows])

    @cached_property
    def _median(self) -> NDArray[np.floating]:
        return np.asarray(np.median(self._lacks, axis=0))

    def _moved_in(self, d: int) -> Array:
        match, back = self._match(d), self._back[d]
        assert back is not None
        near = match.contested - self._median < RECOGNISED
        return moved(match.at, near & returned(match, back, ROUND_TRIP))

    def _match(self, d: int) -> Match:
        match = self._there[d]
        assert match is not None
        return match


@dataclass(frozen=True)
class Strange:
    """How much worse than others the moments of one demonstration are found in the references."""

    sides: tuple[tuple[Side, ...], ...]
    """Once by nearest moments and once by counterparts, per reference but itself."""
    curves: tuple[Array, ...]
    """(n,) of each way: what a share SHARED of the references says."""


def strange_in(found: Counterparts) -> list[Strange]:
    """Return per demonstration how strange its moments are, whoever is trusted."""
    well = [_found_well(row) for row in found.there]
    results = []
    for d in range(len(found.lengths)):
        matches = [(row[d], best) for row, best in zip(found.back, well, strict=True)]
        both = [_strange(match, best) for match, best in matches if match is not None]
        sides = tuple(zip(*both, strict=True))
        curves = (np.quantile([side.curve for side in way], SHARED, axis=0) for way in sides)
        results.append(Strange(sides, tuple(curves)))
    return results


def _found_well(row: Sequence[Match | None]) -> tuple[Array, Array]:
    """Return how far the moments of a reference are where they are found best, in both ways."""
    matches = [match for match in row if match is not None]
    near, contested = [m.near for m in matches], [m.contested for m in matches]
    return np.quantile(near, WELL, axis=0), np.quantile(contested, WELL, axis=0)


def _strange(match: Match, well: tuple[Array, Array]) -> tuple[Side, Side]:
    near, contested = well
    return (
        Side(np.asarray(match.near - near[match.nearest], np.float64), match.nearest),
        Side(np.asarray(match.contested - contested[match.at], np.float64), match.at),
    )


_Result = tuple[float, Stretch, Stretch]


class _Comparison:
    """A demonstration compared with all references."""

    def __init__(self, references: Sequence[Reference], strange: Strange, d: int) -> None:
        self._strange, self._d = strange, d
        self._references = [reference for reference in references if reference.number != d]
        self._trusted = [reference for reference in self._references if reference.trusted]
        self._lacks = {reference.number: reference.lack(d) for reference in self._references}

    def missing(self) -> _Result:
        filled = self._strange.curves[0]
        lacks = [self._lacks[reference.number] for reference in self._trusted]
        values = [
            less(worst(lack), replaced(Side(lack, r.at(self._d)), filled, *peak(lack)))
            for r, lack in zip(self._trusted, lacks, strict=True)
        ]
        return self._middle(values, lacks)

    def order(self) -> _Result:
        shifts = [reference.shift(self._d) for reference in self._trusted]
        return self._middle([worst(shift) for shift in shifts], shifts)

    def extra(self) -> _Result:
        ways = zip(self._strange.curves, self._strange.sides, strict=True)
        return max((self._extra(*way) for way in ways), key=lambda result: result[0])

    def _extra(self, curve: Array, sides: Sequence[Side]) -> _Result:
        start, stop = peak(curve)
        shares = [
            replaced(Side(curve, side.at), lack, start, stop)
            for side, lack in zip(sides, self._lacks.values(), strict=True)
        ]
        value = less(worst(curve), float(np.median(shares)))
        nearest = int(np.argmin([side.curve[start:stop].mean() for side in sides]))
        places = sides[nearest].at[start:stop]
        other = Stretch(self._references[nearest].number, int(places.min()), int(places.max()) + 1)
        return value, Stretch(self._d, start, stop), other

    def _middle(self, values: Sequence[float], curves: Sequence[Array]) -> _Result:
        """Sum up the values of the trusted references; the places are those of the median one."""
        chosen = int(np.argsort(values, kind="stable")[len(values) // 2])
        reference = self._trusted[chosen]
        start, stop = peak(curves[chosen])
        places = np.sort(reference.at(self._d)[start:stop])
        low, high = np.quantile(places, (0.25, 0.75)).astype(int)
        own = Stretch(self._d, int(low), int(high) + 1)
        return float(np.median(values)), own, Stretch(reference.number, start, stop)


def less(value: float, share: float) -> float:
    """Return evidence about a stretch of which a share is replaced."""
    return value * (1 - share) if value > 0 else value


def _evidence(results: Sequence[_Result]) -> Evidence:
    values, own, other = zip(*results, strict=True)
    return Evidence(np.array(values), tuple(own), tuple(other))
