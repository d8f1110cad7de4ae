"""Feature maps of frames, and altered copies of frames to learn from.

A decision depends on small details (milk in the cup, sugar in the pot, a glowing plate), so the
maps keep stride 16 and are not pooled here. The network is pretrained, frozen and the same as the
filter's.

Ten demonstrations show ten placements of every cup and jug; shifted copies stand in for those in
between. Frames of a pool were smoothed by video compression, those of a camera were not, so copies
also get noise.
"""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray

from filtering.vision.backbone import BATCH, feature_maps
from filtering.vision.determinism import one_thread

Maps = NDArray[np.float16]
"""Feature maps (..., K, C, h, w) of K cameras; half precision, because a pool has many."""

NO_MAPS = (0, 0, 1, 1)
"""Shape (K, C, h, w) of the maps without cameras."""

SHIFT = 0.07
"""Largest shift to each side, relative to the height of the frame."""
LIGHT = 0.15
"""Largest relative change of brightness."""
NOISE = 4.0
"""Largest standard deviation of added pixel noise [grey levels]."""
REMEMBERED = 1024
"""Pictures whose maps are remembered: policies that are compared see the same ones."""


def views(frames: NDArray[np.uint8], copies: int, random: np.random.Generator) -> NDArray[np.uint8]:
    """Return frames (n, H, W, 3) and `copies` altered ones of each, (n, 1 + copies, H, W, 3)."""
    altered = [[_alter(frame, random) for _ in range(copies)] for frame in frames]
    return np.stack(
        [np.stack([frame, *others]) for frame, others in zip(frames, altered, strict=True)]
    )


def camera_maps(pixels: Mapping[str, NDArray[np.uint8]], cameras: tuple[str, ...]) -> Maps:
    """Compute the feature maps of `cameras`, in that order.

    Args:
        pixels: camera -> frames (n, H, W, 3) RGB.
        cameras: K names.

    Returns:
        Feature maps (n, K, C, H / 16, W / 16).
    """
    with one_thread(), torch.inference_mode():
        return np.stack([_maps(pixels[camera]) for camera in cameras], axis=1)


def picture_maps(pixels: Mapping[str, NDArray[np.uint8]], cameras: tuple[str, ...]) -> Maps:
    """Return the feature maps (1, K, C, H / 16, W / 16) of one picture (H, W, 3) per camera."""
    return np.stack(
        [_remembered(pixels[camera].tobytes(), pixels[camera].shape) for camera in cameras], axis=1
    )


@lru_cache(maxsize=REMEMBERED)
def _remembered(picture: bytes, shape: tuple[int, ...]) -> Maps:
    frame = np.frombuffer(picture, dtype=np.uint8).reshape(shape).copy()
    return camera_maps({"": frame[None]}, ("",))[:, 0]


def _alter(frame: NDArray[np.uint8], random: np.random.Generator) -> NDArray[np.uint8]:
    """Shift a frame, mirroring its edge into the gap, scale its brightness and add noise."""
    height, width, _ = frame.shape
    reach = round(SHIFT * height)
    padded = np.pad(frame, ((reach, reach), (reach, reach), (0, 0)), mode="reflect")
    top, left = random.integers(0, 2 * reach, size=2, endpoint=True)
    light = random.uniform(1 - LIGHT, 1 + LIGHT)
    moved = padded[top : top + height, left : left + width].astype(np.float32)
    noise = random.normal(0, random.uniform(0, NOISE), frame.shape)
    return (moved * light + noise).round().clip(0, 255).astype(np.uint8)


def _maps(frames: NDArray[np.uint8]) -> Maps:
    """Feature maps (n, C, H / 16, W / 16) of frames (n, H, W, 3)."""
    batches = [
        feature_maps(frames[first : first + BATCH])[0].half()
        for first in range(0, len(frames), BATCH)
    ]
    maps: Maps = torch.cat(batches).numpy()
    return maps
