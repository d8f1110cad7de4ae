"""Feature maps of a clip to activations over time, the paper's "IAD" (section 3.2).

A 1x1 convolution reduces the C channels of a pretrained network to N = 32, and the maximum over
the picture says how strongly each of them is seen in a frame, wherever it is. The convolution is
learned by naming the sub-task of a clip from the maximum over its time.
"""

from collections.abc import Sequence
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from filtering.features.config import BottleneckConfig
from filtering.features.training import class_labels, predict_logits, train
from filtering.vision.determinism import one_thread, seeded
from teasim.common.errors import ConfigError

SCALE_FLOOR = 0.05
"""Least scale of a channel of the feature maps; one that never changes must not become noise."""

FeatureMaps = NDArray[np.floating]
"""The feature maps of one clip.  # (n, C, h, w)"""


class BottleneckNetwork(nn.Module):
    """Feature maps (n, C, h, w) -> activations (n, N), and these -> logits (T,).

    The normaliser of the maps is part of the weights.
    """

    map_mean: Tensor
    map_scale: Tensor

    def __init__(self, inputs: int, channels: int, classes: int, seed: int) -> None:
        """Draw the initial weights from `seed`; C = `inputs`, N = `channels`, T = `classes`."""
        super().__init__()
        self.register_buffer("map_mean", torch.zeros(inputs, 1))
        self.register_buffer("map_scale", torch.ones(inputs, 1))
        with seeded(seed):
            self.reduce = nn.Linear(inputs, channels)
            self.head = nn.Linear(channels, classes)

    def standardise(self, mean: NDArray[np.float64], deviation: NDArray[np.float64]) -> None:
        """Set the normaliser from mean and standard deviation (C,) of the training maps."""
        self.map_mean.copy_(torch.from_numpy(mean)[:, None])
        self.map_scale.copy_(torch.from_numpy(np.hypot(deviation, SCALE_FLOOR))[:, None])

    def activations(self, maps: Tensor) -> Tensor:
        """(n, C, h, w) -> (n, N): each channel's maximum over the picture."""
        return self.excitation(maps).amax(dim=2) + self.reduce.bias

    def excitation(self, maps: Tensor) -> Tensor:
        """(n, C, h, w) -> (n, N, h * w): each channel over the picture, without its bias."""
        pixels = (maps.flatten(2) - self.map_mean) / self.map_scale
        seen: Tensor = self.reduce.weight @ pixels
        return seen

    def forward(self, maps: Tensor, lengths: Sequence[int]) -> Tensor:
        """Frames of b clips, one after the other, with their numbers of frames -> (b, T)."""
        clips = self.activations(maps).split(list(lengths))
        strongest = torch.stack([clip.amax(dim=0) for clip in clips])
        logits: Tensor = self.head(strongest)
        return logits


class Bottleneck:
    """Learns the reduction of feature maps to activations.

    After `fit`:
        network_: the trained `BottleneckNetwork`.
        history_: mean cross-entropy of each epoch [nats].
    """

    network_: BottleneckNetwork
    history_: tuple[float, ...]

    def __init__(self, config: BottleneckConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or BottleneckConfig()

    def fit(self, clips: Sequence[FeatureMaps], labels: Sequence[int]) -> Self:
        """Learn from S clips of sub-tasks, (n, C, h, w) each, and their labels 0..T-1.

        Raises:
            ConfigError: the labels give nothing to learn, the clips differ in C, or one of them is
                not finite.
        """
        numbers, classes = class_labels(labels, len(clips))
        inputs = np.atleast_2d(clips[0]).shape[1]
        _check(clips, inputs)
        training = self.config.training
        network = BottleneckNetwork(inputs, self.config.channels, classes, training.seed)
        network.standardise(*_moments(clips))
        self.history_ = train(network, _Forward(network, clips), numbers, training)
        self.network_ = network
        return self

    def transform(self, clips: Sequence[FeatureMaps]) -> list[NDArray[np.float32]]:
        """Return per clip its activations (n, N).

        Raises:
            ConfigError: a clip has another number of channels than in `fit`, or is not finite.
        """
        _check(clips, len(self.network_.map_mean))
        with one_thread(), torch.inference_mode():
            return [self.network_.activations(_tensor(clip)).numpy() for clip in clips]

    def channel_maps(self, clip: FeatureMaps, channel: int) -> NDArray[np.float32]:
        """Return (n, h, w): where in the frames of a clip (n, C, h, w) a channel is excited.

        Raises:
            ConfigError: the clip has another number of channels than in `fit`, or is not finite.
        """
        _check([clip], len(self.network_.map_mean))
        with one_thread(), torch.inference_mode():
            seen = self.network_.excitation(_tensor(clip))[:, channel]
        return seen.numpy().reshape(len(clip), *clip.shape[2:])

    def predict(self, clips: Sequence[FeatureMaps]) -> NDArray[np.int64]:
        """Return the likeliest sub-task of each clip, (S,).

        Raises:
            ConfigError: a clip has another number of channels than in `fit`, or is not finite.
        """
        network = self.network_
        _check(clips, len(network.map_mean))
        batch = self.config.training.batch
        logits = predict_logits(network, _Forward(network, clips), len(clips), batch)
        return logits.argmax(axis=1)


class _Forward:
    """The logits of chosen clips; holds no copy of their maps, which are large."""

    def __init__(self, network: BottleneckNetwork, clips: Sequence[FeatureMaps]) -> None:
        self.network, self.clips = network, clips

    def __call__(self, chosen: Sequence[int]) -> Tensor:
        maps = [_tensor(self.clips[number]) for number in chosen]
        logits: Tensor = self.network(torch.cat(maps), [len(clip) for clip in maps])
        return logits


def _tensor(clip: FeatureMaps) -> Tensor:
    # A copy: torch can use neither a reversed nor a read-only array as it is.
    return torch.from_numpy(np.array(clip, dtype=np.float32, order="C"))


def _moments(clips: Sequence[FeatureMaps]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return mean and standard deviation (C,) over all pixels of all frames."""
    axes = (0, 2, 3)
    pixels = sum(clip[:, 0].size for clip in clips)
    mean = sum(clip.sum(axis=axes, dtype=np.float64) for clip in clips) / pixels
    centred = (np.square(clip - mean[:, None, None]).sum(axis=axes) for clip in clips)
    return mean, np.sqrt(sum(centred) / pixels)


def _check(clips: Sequence[FeatureMaps], inputs: int) -> None:
    for number, clip in enumerate(clips):
        if clip.ndim != 4 or clip.shape[1] != inputs or not clip.size:
            raise ConfigError(
                f"The feature maps of clip {number} have shape {clip.shape}; "
                f"the bottleneck reads (frames, {inputs}, height, width)."
            )
        if not np.isfinite(clip).all():
            raise ConfigError(f"The feature maps of clip {number} are not all finite numbers.")
