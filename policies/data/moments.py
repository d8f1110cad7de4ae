"""Mean and spread of what a network is shown."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


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
