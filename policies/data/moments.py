"""Mean and standard deviation of the inputs of a network over a weighted training set."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from policies.data.samples import DecisionSamples


@dataclass(frozen=True)
class Moments:
    """Mean and standard deviation of the inputs of a network over its training set."""

    map_mean: NDArray[np.float64]
    """Mean of each channel of the feature maps.  # (K, C)"""
    map_deviation: NDArray[np.float64]
    """Their standard deviation.  # (K, C)"""
    low_dim_mean: NDArray[np.float64]
    """Mean of each number of the state [its unit].  # (S,)"""
    low_dim_deviation: NDArray[np.float64]
    """Its standard deviation [its unit].  # (S,)"""


def weighted_moments(samples: DecisionSamples, shares: NDArray[np.float64]) -> Moments:
    """Mean and standard deviation of the inputs of `samples` under `shares` (n,) that sum to 1."""
    rest = (0, 3, 4)  # views and positions in the picture
    means = np.stack([maps.mean(axis=rest, dtype=np.float64) for maps in samples.maps])
    squares = np.stack([np.square(maps, dtype=np.float64).mean(axis=rest) for maps in samples.maps])
    map_mean = np.tensordot(shares, means, axes=1)
    map_variance = np.tensordot(shares, squares, axes=1) - map_mean**2
    numbers = samples.low_dim.astype(np.float64)
    mean = shares @ numbers
    deviation = np.sqrt(shares @ (numbers - mean) ** 2)
    return Moments(map_mean, np.sqrt(np.maximum(map_variance, 0.0)), mean, deviation)
