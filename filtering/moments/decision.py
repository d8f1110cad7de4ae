"""From evidence of several kinds and cameras to one loss per demonstration, and a cut.

Raw evidence is comparable within a pool, less so between pools: where people differ or orders are
free, all of it is larger. So each kind counts by how far it lies above the median of the pool, in
units of how much the lower half of the pool scatters, which a minority of incorrect demonstrations
does not touch. In a small pool that scatter s is hardly known; TYPICAL, the scatter of usual videos
in other pools, counts for as much as PRIOR demonstrations:

    z = max(0, value - median) / sqrt((PRIOR TYPICAL^2 + D s^2) / (PRIOR + D)),
    loss = 1/2 sum over kinds of z^2,

the log-likelihood ratio of Gaussians [nats]. Of several cameras the most telling one counts for
each kind; a camera that sees little, or moves, has a large scatter of its own and tells little.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("missing", "order", "extra", "ineffective")
"""Kinds of evidence."""
TYPICAL: Mapping[str, float] = MappingProxyType(
    {"missing": 0.12, "order": 0.25, "extra": 0.13, "ineffective": 0.3}
)
"""Scatter of each kind among usual videos in the unit of `scaled`; chosen on the scenes TUNED_ON
(`scripts/check_scenes.py`), as are PRIOR and CUT."""
PRIOR = 20.0
"""Demonstrations that TYPICAL counts for."""
CUT = 13.5
"""Loss above which a demonstration is flagged [nats]."""
LOWER = 0.16
"""Quantile that lies a standard deviation below the median of a Gaussian."""
ORDER_OFFSET = 0.3
"""Added to the evidence of order before its logarithm is taken: small shifts are all alike."""
ALL_LACKED, MOST_LACKED = 7.0, 6.4
"""What a video lacks of an effect that it lacks altogether, and the most of it that is told apart;
see `effects`."""


def exceedances(kind: str, values: Array) -> Array:
    """Return (D,): z, how far evidence lies above what is usual in the pool.

    Args:
        kind: one of KINDS.
        values: (D,) its evidence against each demonstration.
    """
    comparable = scaled(kind, values)
    median, count = np.median(comparable), len(values)
    scatter = median - np.quantile(comparable, LOWER)
    squared = PRIOR * TYPICAL[kind] ** 2 + count * scatter**2
    return np.asarray(np.maximum(comparable - median, 0.0) / np.sqrt(squared / (PRIOR + count)))


def scaled(kind: str, values: Array) -> Array:
    """Return (D,): evidence on a logarithmic scale.

    Missing and extra are logarithms already; of effects it is that of the share that is there.
    """
    if kind == "order":
        return np.asarray(np.log(values + ORDER_OFFSET))
    if kind == "ineffective":
        return np.asarray(-np.log(1 - np.clip(values, 0.0, MOST_LACKED) / ALL_LACKED))
    return values


def telling(cameras: Sequence[Array]) -> NDArray[np.int64]:
    """Return (D,): for each demonstration the camera with the largest exceedance."""
    return np.asarray(np.argmax(np.stack(cameras), axis=0))


def losses_of(exceeded: Mapping[str, Array]) -> Array:
    """Return (D,): losses [nats] from the exceedances of all kinds."""
    return np.asarray(0.5 * np.sum([np.square(z) for z in exceeded.values()], axis=0))
