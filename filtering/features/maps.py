"""Frames of segments to feature maps of the pretrained network (paper section 3.2)."""

import numpy as np
from numpy.typing import NDArray

from filtering.features.extraction import foreground
from filtering.vision.frames import Frames, segment_indices
from teasim.pool import Span
from teasim.pool.source import Clip

Maps = NDArray[np.float16]
"""Stride-16 feature maps of frames; half precision halves their memory.  # (n, C, h, w)"""


def segment_maps(clip: Clip, spans: tuple[Span, ...], count: int, background: str) -> list[Maps]:
    """Return per segment the feature maps (n, C, h, w) of at most `count` of its frames.

    Raises:
        ConfigError: there is no such background subtraction.
        PoolError: the video is missing or damaged.
    """
    indices = segment_indices(spans, count)
    used = np.unique(np.concatenate(indices))
    maps = frame_maps(foreground(clip, used, background))
    return [maps[np.searchsorted(used, chosen)] for chosen in indices]


def frame_maps(frames: Frames) -> Maps:
    """Return the stride-16 feature maps (n, C, h, w) of frames (n, H, W, 3)."""
    import torch

    from filtering.vision.backbone import BATCH, feature_maps
    from filtering.vision.determinism import one_thread

    with one_thread(), torch.inference_mode():
        parts = [
            feature_maps(frames[first : first + BATCH])[0].numpy().astype(np.float16)
            for first in range(0, len(frames), BATCH)
        ]
    return np.concatenate(parts)
