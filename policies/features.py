"""What a policy computes from an observation: where in the picture things look how.

A decision hangs on small things (milk in the cup, the level of the sugar pot, a glowing plate), so
the stride-16 maps of the pretrained network are pooled per cell of a grid and not over the whole
picture. The network is frozen and is the filter's own; this is the one module of the learners that
imports from `filtering`, and it takes nothing else from there.
"""

from collections.abc import Mapping

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import adaptive_avg_pool2d

from filtering.backbone import BATCH, load_backbone
from policies.base import ObservationSpec
from policies.networks import one_thread

GRID = 7
"""Cells per side; a cell of a 224 pixel frame is 32 pixels wide."""


def decision_inputs(
    pixels: Mapping[str, NDArray[np.uint8]],
    joints: NDArray[np.float32] | None,
    spec: ObservationSpec,
) -> NDArray[np.float32]:
    """Concatenate the picture features of the cameras of `spec` and the joint positions.

    Args:
        pixels: camera -> frames (n, H, W, 3) RGB.
        joints: joint positions (n, J) [rad; m], None if the policy sees frames alone.
        spec: what the policy looks at; sets the order of the cameras.

    Returns:
        Features (n, F).
    """
    parts = [picture_features(pixels[camera]) for camera in spec.cameras]
    if joints is not None:
        parts.append(np.asarray(joints, dtype=np.float32))
    return np.concatenate(parts, axis=1)


def picture_features(frames: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Average the stride-16 maps of frames (n, H, W, 3) per grid cell, (n, C * GRID * GRID)."""
    with one_thread(), torch.inference_mode():
        batches = [
            adaptive_avg_pool2d(_stride_16(frames[first : first + BATCH]), GRID).flatten(1)
            for first in range(0, len(frames), BATCH)
        ]
        pooled: NDArray[np.float32] = torch.cat(batches).numpy()
    return pooled


def _stride_16(frames: NDArray[np.uint8]) -> torch.Tensor:
    """Feature maps (n, 112, H / 16, W / 16) of a batch of frames (n, H, W, 3)."""
    images = torch.from_numpy(np.ascontiguousarray(frames)).permute(0, 3, 1, 2)
    scaled = (images.to(torch.float32) - 127.0) / 128.0
    maps: list[torch.Tensor] = load_backbone()(scaled.contiguous(memory_format=torch.channels_last))
    return maps[0]
