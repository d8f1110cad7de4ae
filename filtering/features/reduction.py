"""One short vector per segment: standardise over the pool, then keep the main components."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

MAX_COMPONENTS = 32
"""Most components kept, the paper's 1x32 per segment (section 3.2)."""
EXPLAINED = 0.99
"""Share of the pool's variance that the kept components hold, if fewer than the most."""
CONSTANT = 1e-6
"""Features whose standard deviation is below this share of the largest one are dropped."""


def reduce_features(
    features: Sequence[NDArray[np.floating]],
) -> list[NDArray[np.float64]]:
    """Return per demonstration (q, K), K <= 32, with mean squared row length 1 over the pool.

    The components keep their variances (no whitening): the ridge of equation 3 then holds small,
    noisy directions back by itself.

    Args:
        features: per demonstration (q, F), one row per segment.
    """
    stacked = np.vstack(features).astype(np.float64)
    centred = stacked - stacked.mean(axis=0)
    spread = centred.std(axis=0)
    varying = spread > CONSTANT * max(spread.max(), 1e-12)
    if not varying.any():
        return [np.zeros((len(rows), 1)) for rows in features]
    components = _main_components(centred[:, varying] / spread[varying])
    components /= np.sqrt((components**2).sum(axis=1).mean())
    ends = np.cumsum([len(rows) for rows in features])[:-1]
    return np.split(components, ends)


def _main_components(standardised: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rows (S, F) in their main directions, (S, K)."""
    left, strength, right = np.linalg.svd(standardised, full_matrices=False)
    shares = np.cumsum(strength**2) / np.sum(strength**2)
    count = min(MAX_COMPONENTS, int(np.searchsorted(shares, EXPLAINED)) + 1)
    # The sign of a component is arbitrary; fix it so that printed features repeat.
    largest = right[np.arange(len(right)), np.abs(right).argmax(axis=1)]
    components: NDArray[np.float64] = left * strength * np.sign(largest)
    return components[:, :count]
