"""Features of a video made comparable with those of others: camera and light are taken out."""

import numpy as np
from numpy.typing import NDArray

SCALINGS = ("video", "training")
"""What features are centred and scaled by before the training set's own moments."""
SCALE_FLOOR = 0.05
"""Least scale of a feature [mean scale of all]; what hardly varies must not become noise."""

Features = NDArray[np.float32]


def scaled(features: Features, scaling: str) -> Features:
    """Return features (n, D) of a video with mean 0 and scale 1, or as they are for `training`."""
    if scaling == "training":
        return features
    mean, scale = mean_and_scale(features)
    return (features - mean) / scale


def mean_and_scale(features: Features) -> tuple[Features, Features]:
    """Return mean and scale, (D,) each, of rows (n, D)."""
    mean = features.mean(axis=0, dtype=np.float64)
    deviation = features.std(axis=0, dtype=np.float64)
    floor = SCALE_FLOOR * deviation.mean()
    scale = np.maximum(deviation, floor if floor > 0.0 else 1.0)
    return mean.astype(np.float32), scale.astype(np.float32)
