"""From evidence of several kinds and cameras to one loss per demonstration, and a cut.

Raw evidence is comparable within a pool, less so between pools: where people differ or orders are
free, all of it is larger. So each kind counts by how far it lies above the median of the trusted
demonstrations, in units of how much those scatter. In a small pool that scatter s is hardly known;
TYPICAL, the scatter of usual videos in other pools, counts for as much as PRIOR demonstrations:

    z = max(0, value - median) / sqrt((PRIOR TYPICAL^2 + T s^2) / (PRIOR + T)),
    loss = 1/2 sum over kinds of z^2,

the log-likelihood ratio of Gaussians [nats]. Everybody is trusted at first. Gross mistakes hide
small ones, because what many do passes for variety; those whose loss is DISTRUST times the cut are
therefore trusted no longer, and what is usual, the evidence, median and scatter are found again
from the others (`judge`). Of several cameras the most telling one counts for each kind; a camera
that sees little, or moves, has a large scatter of its own and tells little.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from filtering.moments.evidence import Trusted

Array = NDArray[np.float64]

KINDS = ("missing", "order", "extra", "ineffective")
"""Kinds of evidence."""
TYPICAL: Mapping[str, float] = MappingProxyType(
    {"missing": 0.12, "order": 0.25, "extra": 0.13, "ineffective": 0.2}
)
"""Scatter of each kind among usual videos, of order that of its logarithm; chosen on tea-making
and the scenes TUNED_ON (`scripts/check_scenes.py`), as are PRIOR, CUT and DISTRUST."""
PRIOR = 20.0
"""Demonstrations that TYPICAL counts for."""
CUT = 12.0
"""Loss above which a demonstration is flagged [nats]."""
DISTRUST = 2.0
"""Loss above which a demonstration does not say what is usual [CUT]. At 1, honest variety lost
its rarest members one after the other."""
MAD_TO_DEVIATION = 1.4826
"""Standard deviation of a Gaussian [median absolute deviation]."""
ORDER_OFFSET = 0.3
"""Added to the evidence of order before its logarithm is taken: small shifts are all alike."""
ROUNDS = 3
"""Most times that trust is revised."""


def judge(
    evidence: Callable[[Trusted], Sequence[Mapping[str, Array]]], count: int
) -> tuple[Trusted, list[dict[str, Array]]]:
    """Find whom to trust; return it, (D,), and the exceedances per camera and kind, (D,) each.

    Trust once lost does not return, and is not taken from more than half of the demonstrations.

    Args:
        evidence: returns the evidence of every kind per camera, (D,), once it is told whom to
            trust.
        count: D, the number of demonstrations.
    """
    trusted = np.ones(count, dtype=np.bool_)
    for attempt in range(ROUNDS + 1):
        exceeded = [
            {kind: exceedances(kind, values[kind], trusted) for kind in KINDS}
            for values in evidence(trusted)
        ]
        losses = losses_of(most_telling(exceeded))
        revised = trusted & (losses <= DISTRUST * CUT)
        if attempt == ROUNDS or np.array_equal(revised, trusted) or 2 * revised.sum() < count:
            break
        trusted = revised
    return trusted, exceeded


def exceedances(kind: str, values: Array, trusted: Trusted) -> Array:
    """Return (D,): z, how far evidence lies above what is usual among the trusted.

    Args:
        kind: one of KINDS.
        values: (D,) its evidence against each demonstration.
        trusted: (D,) True for those that say what is usual.
    """
    comparable = np.log(values + ORDER_OFFSET) if kind == "order" else values
    usual = comparable[trusted]
    median, count = np.median(usual), len(usual)
    scatter = MAD_TO_DEVIATION * np.median(np.abs(usual - median))
    squared = PRIOR * TYPICAL[kind] ** 2 + count * scatter**2
    return np.asarray(np.maximum(comparable - median, 0.0) / np.sqrt(squared / (PRIOR + count)))


def most_telling(exceeded: Sequence[Mapping[str, Array]]) -> dict[str, Array]:
    """Return per kind (D,): the largest exceedance that a camera gives."""
    return {kind: np.max([one[kind] for one in exceeded], axis=0) for kind in KINDS}


def telling(cameras: Sequence[Array]) -> NDArray[np.int64]:
    """Return (D,): for each demonstration the camera with the largest exceedance."""
    return np.asarray(np.argmax(np.stack(cameras), axis=0))


def losses_of(exceeded: Mapping[str, Array]) -> Array:
    """Return (D,): losses [nats] from the exceedances of all kinds."""
    return np.asarray(0.5 * np.sum([np.square(z) for z in exceeded.values()], axis=0))
