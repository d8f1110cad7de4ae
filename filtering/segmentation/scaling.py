"""Normalisation of the features of a video, which removes the influence of camera and light."""

import numpy as np
from numpy.typing import NDArray

SCALINGS = ("video", "training")
"""Names of the normalisations that precede that of the training set."""
LEAST_SCALE = 0.05
"""Least scale of a feature [mean scale of all]; nearly constant features must not become noise."""

Features = NDArray[np.float32]
"""(n, D) one row per frame."""


def scaled(features: Features, scaling: str) -> Features:
    """Return features (n, D) with mean 0 and scale 1, or unchanged for `training`."""
    if scaling == "training":
        return features
    mean, scale = mean_and_scale(features)
    return (features - mean) / scale


def mean_and_scale(features: Features) -> tuple[Features, Features]:
    """Return mean and scale, (D,) each, of rows (n, D)."""
    mean = features.mean(axis=0, dtype=np.float64)
    deviation = features.std(axis=0, dtype=np.float64)
    least = LEAST_SCALE * deviation.mean()
    scale = np.maximum(deviation, least if least > 0.0 else 1.0)
    return mean.astype(np.float32), scale.astype(np.float32)
