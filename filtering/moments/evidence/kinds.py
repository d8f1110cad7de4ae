"""What counterparts say against a demonstration: a stretch is missing, out of order or extra.

With c_rd(t) the contested log distance of the counterpart in video d of moment t of reference r,
at_rd(t) its place, moved_rd(t) the share of the sure moments that it has passed, Q_k the value
that a share VARIETY of the trusted videos reach, and W_k the quantile WELL over all videos:

    missing    c_rd(t) - Q_k c_rk(t)
    order      moved_rd(t) - Q_k moved_rk(t)
    extra      c_dr(t) - W_k c_rk(at_dr(t))                            of moments t of d itself

Order counts only where the counterpart of the counterpart is the moment itself, and for nothing
that recurs, such as rests; what recurs in both videos is neither missing nor extra, see
`counterparts`. What a share VARIETY of the videos does, an optional step left out or another legal
order, is thus never evidence; nor is what is usual among the demonstrations of the same look, see
`peers`. A curve of order is summed up by the mean of its largest twelfth over t, because a step is
a part of a video; one of missing or extra moments by that of its largest second, because much of a
step looks like other steps. Missing and order take the median over the trusted references of the
same look, because a reference may be incorrect too; extra takes the quantile SHARED over all of
them, so that trust does not change it. Extra is also found from plain nearest moments in place of
counterparts, and the larger value counts: a step done twice is seen in contested places alone, and
one that nobody else does better in plain ones. Missing and extra count less the more of the stretch
is replaced, see `replaced`.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from filtering.moments.evidence.replaced import Side, replaced
from filtering.moments.evidence.strange import Strange
from filtering.moments.evidence.stretches import Evidence, Stretch, brief, less, peak, worst
from filtering.moments.evidence.usual import FEWEST, Reference

Array = NDArray[np.float64]


def missing_order_extra(
    alike: Sequence[Reference], references: Sequence[Reference], strange: Sequence[Strange]
) -> tuple[Evidence, Evidence, Evidence]:
    """Return the evidence of the three kinds, in the order of the name.

    Args:
        alike: what is usual for the same actor: what another one does is found worse in others.
        references: what is usual whoever acts: an order is no matter of looks.
        strange: per demonstration how strange its moments are, see `strange_in`.
    """
    by_actor = [_Comparison(alike, one, d) for d, one in enumerate(strange)]
    by_all = [_Comparison(references, one, d) for d, one in enumerate(strange)]
    return (
        _evidence([one.missing() for one in by_actor]),
        _evidence([one.order() for one in by_all]),
        _evidence([one.extra() for one in by_actor]),
    )


_Result = tuple[float, Stretch, Stretch]


class _Comparison:
    """A demonstration compared with the references."""

    def __init__(self, references: Sequence[Reference], strange: Strange, d: int) -> None:
        self._strange, self._d = strange, d
        self._references = [reference for reference in references if reference.number != d]
        trusted = [reference for reference in self._references if reference.trusted]
        near = [reference for reference in trusted if reference.speaks_for(d)]
        self._trusted = near if len(near) >= FEWEST else trusted

    @cached_property
    def _lacks(self) -> dict[int, Array]:
        """Per number of a reference (n,) how much farther than usual its counterparts are."""
        return {reference.number: reference.lack(self._d) for reference in self._references}

    def missing(self) -> _Result:
        filled = self._strange.curves[0]
        lacks = [self._lacks[reference.number] for reference in self._trusted]
        values = [
            less(brief(lack), replaced(Side(lack, r.at(self._d)), filled, *peak(lack)))
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
        value = less(brief(curve), float(np.median(shares)))
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


def _evidence(results: Sequence[_Result]) -> Evidence:
    values, own, other = zip(*results, strict=True)
    return Evidence(np.array(values), tuple(own), tuple(other))
