"""VGG-16 (Simonyan and Zisserman, 2015), the network of the paper, with weights that the user has.

Only the 13 convolutions; the features are those of the last one, 512 channels at stride 16, before
the last pooling. Weights have the names of torchvision's `vgg16`, in a file of safetensors or a
state dict of torch; none are shipped. Frames become 224 x 224 pixels, as in section 3.2.
"""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from pickle import UnpicklingError

import numpy as np
import torch
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.torch import load_file
from torch import Tensor, nn
from torch.nn import functional

from filtering.vision.determinism import one_thread
from filtering.vision.frames import Frames
from teasim.common.errors import ConfigError

BLOCKS = ((64, 2), (128, 2), (256, 3), (512, 3), (512, 3))
"""Channels and number of the 3 x 3 convolutions of each block; a 2 x 2 pooling is between them."""
SIZE = 224
"""Height and width that frames are brought to [pixels]."""
MEAN, DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)
"""Mean and standard deviation of ImageNet's channels, by which torchvision scales [0..1]."""
BATCH = 4
"""Frames per forward pass: 100 MB of feature maps."""
PREFIX = "features."
"""Start of the names of the convolutions; files of the convolutions alone may lack it."""
UNREADABLE = (
    OSError,
    EOFError,
    AttributeError,
    KeyError,
    RuntimeError,
    ValueError,
    UnpicklingError,
    SafetensorError,
)
"""What reading a file leads to that holds no weights."""


class VGG16(nn.Module):
    """The convolutions of VGG-16; their numbers are those of torchvision."""

    def __init__(self) -> None:
        """Create the network with random weights; see `load_vgg16`."""
        super().__init__()
        layers: list[nn.Module] = []
        inputs = 3
        for number, (channels, repeats) in enumerate(BLOCKS):
            layers += [nn.MaxPool2d(2)] * (number > 0)
            for _ in range(repeats):
                layers += [nn.Conv2d(inputs, channels, 3, padding=1), nn.ReLU(inplace=True)]
                inputs = channels
        self.features = nn.Sequential(*layers)

    def forward(self, images: Tensor) -> Tensor:
        """(n, 3, H, W) scaled images -> (n, 512, H / 16, W / 16)."""
        result: Tensor = self.features(images)
        return result


@lru_cache(maxsize=1)
def load_vgg16(weights: Path) -> VGG16:
    """Return the network with the weights of a file, ready for inference.

    Raises:
        ConfigError: the file cannot be read, or holds other weights.
    """
    stored = _read(weights)
    network = VGG16()
    own = network.state_dict()
    for name, value in own.items():
        found = stored.get(name, stored.get(name.removeprefix(PREFIX)))
        if found is None or found.shape != value.shape:
            raise ConfigError(
                f"'{weights}' holds no VGG-16: '{name}' of shape {tuple(value.shape)} is missing; "
                "give the state dict of torchvision's vgg16 with --backbone-weights."
            )
        own[name] = found.float()
    network.load_state_dict(own)
    return network.requires_grad_(False).eval()


def feature_maps(frames: Frames, weights: Path) -> Tensor:
    """Return the last feature map (n, 512, 14, 14) of frames (n, H, W, 3), one batch."""
    images = torch.from_numpy(np.ascontiguousarray(frames)).permute(0, 3, 1, 2).float() / 255
    if images.shape[2:] != (SIZE, SIZE):
        images = functional.interpolate(images, (SIZE, SIZE), mode="bilinear", antialias=True)
    mean, deviation = (torch.tensor(values).reshape(1, 3, 1, 1) for values in (MEAN, DEVIATION))
    result: Tensor = load_vgg16(weights)((images - mean) / deviation)
    return result


def describe_frames(frames: Frames, weights: Path) -> NDArray[np.float32]:
    """Return average and maximum over the picture of each channel, (n, 1024), with one thread."""
    parts = []
    with one_thread(), torch.inference_mode():
        for first in range(0, len(frames), BATCH):
            maps = feature_maps(frames[first : first + BATCH], weights)
            parts.append(torch.cat([maps.mean(dim=(2, 3)), maps.amax(dim=(2, 3))], dim=1))
    result: NDArray[np.float32] = torch.cat(parts).numpy()
    return result


def _read(path: Path) -> Mapping[str, Tensor]:
    try:
        if path.suffix == ".safetensors":
            return load_file(path)
        stored = torch.load(path, weights_only=True, map_location="cpu")
        return {str(name): value for name, value in stored.items() if hasattr(value, "shape")}
    except UNREADABLE as error:
        raise ConfigError(
            f"'{path}' cannot be read as weights; give a safetensors file or a state dict of torch "
            "with --backbone-weights."
        ) from error
