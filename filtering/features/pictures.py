"""What a channel looks at: its activation over the frame in which it is strongest (appendix B)."""

import numpy as np
from numpy.typing import NDArray

from filtering.features.bottleneck import Bottleneck, FeatureMaps
from filtering.vision.frames import Frames

STRENGTH = 0.6
"""Opacity of the strongest activation over the frame."""


def overlay(
    bottleneck: Bottleneck, frames: Frames, maps: FeatureMaps, channel: int
) -> NDArray[np.uint8]:
    """Return the frame (H, W, 3) in which a channel is strongest, with what excites it in red.

    Args:
        bottleneck: the trained bottleneck.
        frames: (n, H, W, 3) the frames of a segment.
        maps: (n, C, h, w) their feature maps.
        channel: which of the bottleneck's N channels.
    """
    import cv2

    heat = bottleneck.channel_maps(maps, channel)
    strongest = heat[int(heat.max(axis=(1, 2)).argmax())]
    frame = frames[int(heat.max(axis=(1, 2)).argmax())].astype(np.float64)
    # From the frame's middle upwards: half of every map would be red otherwise.
    low, high = np.median(strongest), strongest.max()
    share = np.clip((strongest - low) / max(high - low, 1e-9), 0.0, 1.0)
    size = (frame.shape[1], frame.shape[0])
    opacity = STRENGTH * cv2.resize(share, size, interpolation=cv2.INTER_LINEAR)[..., None]
    mixed = (1 - opacity) * frame + opacity * np.array([255.0, 0.0, 0.0])
    return mixed.round().astype(np.uint8)
