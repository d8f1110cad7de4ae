"""What counterparts say against a demonstration: a stretch is missing, out of order or extra.

With near_rd(t) the distance of the counterpart in video d of moment t of reference r, at_rd(t) its
place, and Q_k the quantile 1 - VARIETY over the other references k, trusted ones alone:

    missing    log near_rd(t) - Q_k log near_rk(t)
    order      |at_rd(t) - m(t)| / (Q_k |at_rk(t) - m(t)| + 0.02)      m(t) = median_k at_rk(t)
    extra      log near_dr(t) - median_k log near_rk(at_dr(t))         of moments t of d itself

Order counts only where the counterpart is no farther than is usual. What a share VARIETY of the
videos does, an optional step left out or another legal order, is thus never evidence. Each curve is
summed up by the mean of its largest twelfth over t, because a step is a part of a video; missing
and order by the median over the references, because a reference may be incorrect too; extra by the
quantile VARIETY.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts

Array = NDArray[np.float64]
Trusted = NDArray[np.bool_]
"""(D,) True for the demonstrations that say what is usual."""

VARIETY = 0.3
"""Share of the trusted videos that makes a behaviour one of several usual ones."""
WORST = 12
"""The worst 1 / WORST of a video counts."""
FOUND = float(np.log(1.3))
"""Largest log of how much farther than usual a counterpart may be to count as found."""
PLACE_NOISE = 0.02
"""Scatter of places that is always allowed for [length of the video]."""
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


def missing_and_order(found: Counterparts, trusted: Trusted) -> tuple[Evidence, Evidence]:
    """Return the evidence that stretches of the trusted references are missing, or out of order."""
    curves = [_Reference(found, row, trusted) for row in rows_of(found, trusted)]
    missing, order = [], []
    for d in range(len(found.lengths)):
        rows = [c for c in curves if c.number != d]
        pairs = [c.departures(d) for c in rows]
        missing.append(_middle([lack for lack, _ in pairs], rows, d))
        order.append(_middle([shift for _, shift in pairs], rows, d))
    return _evidence(missing), _evidence(order)


def extra(found: Counterparts, trusted: Trusted) -> Evidence:
    """Return the evidence that stretches of a demonstration are in no trusted reference."""
    usual = {row: _Reference(found, row, trusted).usual for row in rows_of(found, trusted)}
    results = []
    for d in range(len(found.lengths)):
        rows = [row for row in usual if found.references[row] != d]
        matches = [found.back[row][d] for row in rows]
        curves = np.stack(
            [
                np.log(match.near + TINY) - usual[row][match.at]
                for row, match in zip(rows, matches, strict=True)
                if match is not None
            ]
        )
        curve = np.quantile(curves, VARIETY, axis=0)
        start, stop = peak(curve)
        nearest = int(curves[:, start:stop].mean(axis=1).argmin())
        match = matches[nearest]
        assert match is not None
        places = match.at[start:stop]
        other = Stretch(found.references[rows[nearest]], int(places.min()), int(places.max()) + 1)
        results.append((worst(curve), Stretch(d, start, stop), other))
    return _evidence(results)


def rows_of(found: Counterparts, trusted: Trusted) -> list[int]:
    """Return the rows of the trusted references; of all where fewer than two are trusted."""
    rows = [row for row, r in enumerate(found.references) if trusted[r]]
    return rows if len(rows) >= 2 else list(range(len(found.references)))


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


class _Reference:
    """What is usual among the trusted at each moment of one reference."""

    def __init__(self, found: Counterparts, row: int, trusted: Trusted) -> None:
        self.number = found.references[row]
        self._matches = found.there[row]
        others = [found.references[other] for other in rows_of(found, trusted)]
        self._others = [k for k in others if k != self.number]
        matches = [self._matches[k] for k in self._others]
        self._nears = np.stack([np.log(m.near + TINY) for m in matches if m is not None])
        self._lengths = found.lengths
        self._places = np.stack(
            [self._place(k, m.at) for k, m in zip(self._others, matches, strict=True) if m]
        )
        self.usual: Array = np.median(self._nears, axis=0)

    def _place(self, video: int, at: NDArray[np.int64]) -> Array:
        return np.asarray(at / self._lengths[video])

    def departures(self, d: int) -> tuple[Array, Array]:
        """Return (n,), (n,): how much farther than usual, and how much displaced, d shows it."""
        match = self._matches[d]
        assert match is not None
        kept = [row for row, k in enumerate(self._others) if k != d] or [0]
        lack = np.log(match.near + TINY) - np.quantile(self._nears[kept], 1 - VARIETY, axis=0)
        places = self._places[kept]
        middle = np.median(places, axis=0)
        scatter = np.quantile(np.abs(places - middle), 1 - VARIETY, axis=0) + PLACE_NOISE
        shift = np.abs(self._place(d, match.at) - middle) / scatter
        return lack, np.where(lack < FOUND, shift, 0.0)

    def at(self, d: int) -> NDArray[np.int64]:
        """Return (n,): the counterparts in d."""
        match = self._matches[d]
        assert match is not None
        return match.at


_Result = tuple[float, Stretch, Stretch]


def _middle(curves: Sequence[Array], rows: Sequence[_Reference], d: int) -> _Result:
    """Sum up the curves of all references; the places are those of the median one."""
    values = [worst(curve) for curve in curves]
    chosen = int(np.argsort(values, kind="stable")[len(values) // 2])
    start, stop = peak(curves[chosen])
    places = np.sort(rows[chosen].at(d)[start:stop])
    low, high = np.quantile(places, (0.25, 0.75)).astype(int)
    own = Stretch(d, int(low), int(high) + 1)
    return float(np.median(values)), own, Stretch(rows[chosen].number, start, stop)


def _evidence(results: Sequence[_Result]) -> Evidence:
    values, own, other = zip(*results, strict=True)
    return Evidence(np.array(values), tuple(own), tuple(other))
