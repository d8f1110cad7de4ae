"""What a policy computes from frames: the feature maps of the pretrained network.

A decision hangs on small things (milk in the cup, sugar in the pot, a glowing plate), so the maps
are kept at stride 16 and not pooled here. The network is frozen and is the filter's own; this is
the one module of the learners that imports from `filtering`, and it takes nothing else from there.
"""

from collections.abc import Mapping

import numpy as np
import torch
from numpy.typing import NDArray

from filtering.vision.backbone import BATCH, feature_maps
from filtering.vision.determinism import one_thread

Maps = NDArray[np.float16]
"""Feature maps (..., K, C, h, w) of K cameras; half precision, because a pool has many."""

NO_MAPS = (0, 0, 1, 1)
"""Shape (K, C, h, w) of the maps of no camera."""


def camera_maps(pixels: Mapping[str, NDArray[np.uint8]], cameras: tuple[str, ...]) -> Maps:
    """Compute the maps of `cameras`, in that order.

    Args:
        pixels: camera -> frames (n, H, W, 3) RGB.
        cameras: K names.

    Returns:
        Feature maps (n, K, C, H / 16, W / 16).
    """
    with one_thread(), torch.inference_mode():
        return np.stack([_maps(pixels[camera]) for camera in cameras], axis=1)


def _maps(frames: NDArray[np.uint8]) -> Maps:
    """Feature maps (n, C, H / 16, W / 16) of frames (n, H, W, 3)."""
    batches = [
        feature_maps(frames[first : first + BATCH])[0].half()
        for first in range(0, len(frames), BATCH)
    ]
    maps: Maps = torch.cat(batches).numpy()
    return maps
