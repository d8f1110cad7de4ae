"""From evidence of several kinds and cameras to one loss per demonstration, and a cut.

Raw evidence is comparable within a pool, less so between pools: where people differ or orders are
free, all of it is larger. So each kind counts by how far it lies above the median of the pool, in
units of how much the lower half of the pool scatters, which a minority of incorrect demonstrations
does not touch:

    z = max(0, (value - median) / sqrt(s^2 + floor^2)),        loss = 1/2 sum over kinds of z^2,

the log-likelihood ratio of Gaussians [nats]. Of several cameras the most telling one counts for
each kind; a camera that sees little, or moves, has a large scatter s of its own and tells little.
"""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

KINDS = ("missing", "order", "extra", "ineffective")
"""Kinds of evidence."""
FLOORS: Mapping[str, float] = MappingProxyType(
    {"missing": 0.12, "order": 0.2, "extra": 0.1, "ineffective": 0.6}
)
"""Least scatter of each kind in its own unit; chosen on the scenes TUNED_ON and tea-making
(`scripts/check_scenes.py`)."""
CUT = 6.0
"""Loss above which a demonstration is flagged [nats]; chosen on the same."""
LOWER = 0.16
"""Quantile that lies a standard deviation below the median of a Gaussian."""
ORDER_OFFSET = 0.3
"""Added to the evidence of order before its logarithm is taken: small shifts are all alike."""


def exceedances(kind: str, values: Array) -> Array:
    """Return (D,): z, how far evidence lies above what is usual in the pool.

    Args:
        kind: one of KINDS.
        values: (D,) its evidence against each demonstration.
    """
    scaled = np.log(values + ORDER_OFFSET) if kind == "order" else values
    median = np.median(scaled)
    scatter = median - np.quantile(scaled, LOWER)
    return np.asarray(np.maximum((scaled - median) / np.hypot(scatter, FLOORS[kind]), 0.0))


def telling(cameras: Sequence[Array]) -> NDArray[np.int64]:
    """Return (D,): for each demonstration the camera with the largest exceedance."""
    return np.asarray(np.argmax(np.stack(cameras), axis=0))


def losses_of(exceeded: Mapping[str, Array]) -> Array:
    """Return (D,): losses [nats] from the exceedances of all kinds."""
    return np.asarray(0.5 * np.sum([np.square(z) for z in exceeded.values()], axis=0))
