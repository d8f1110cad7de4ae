"""Views of a frame: as it is, and moved a little, noisier, under another light.

Ten demonstrations show ten places of every cup and jug; shifted copies stand for those in between.
Frames of a pool come out of a video, which has smoothed them; a policy sees what the camera sees.
"""

import numpy as np
from numpy.typing import NDArray

SHIFT = 0.07
"""Largest shift to each side, relative to the height of the frame."""
LIGHT = 0.15
"""Largest relative change of brightness."""
NOISE = 4.0
"""Largest standard deviation of added pixel noise [grey levels]."""


def views(frames: NDArray[np.uint8], copies: int, random: np.random.Generator) -> NDArray[np.uint8]:
    """Return frames (n, H, W, 3) and `copies` altered ones of each, (n, 1 + copies, H, W, 3)."""
    altered = [[_alter(frame, random) for _ in range(copies)] for frame in frames]
    return np.stack(
        [np.stack([frame, *others]) for frame, others in zip(frames, altered, strict=True)]
    )


def _alter(frame: NDArray[np.uint8], random: np.random.Generator) -> NDArray[np.uint8]:
    """Shift a frame, its edge mirrored into the gap, scale its brightness and add noise."""
    height, width, _ = frame.shape
    reach = round(SHIFT * height)
    padded = np.pad(frame, ((reach, reach), (reach, reach), (0, 0)), mode="reflect")
    top, left = random.integers(0, 2 * reach, size=2, endpoint=True)
    light = random.uniform(1 - LIGHT, 1 + LIGHT)
    moved = padded[top : top + height, left : left + width].astype(np.float32)
    noise = random.normal(0, random.uniform(0, NOISE), frame.shape)
    return (moved * light + noise).round().clip(0, 255).astype(np.uint8)
