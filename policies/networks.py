"""The network that scores sub-tasks: what is where does not matter, only whether it is there.

Things stand elsewhere in every demonstration, and a few dozen decisions cannot teach a network
where they might stand. So each camera's feature maps go through a 1x1 bottleneck and a maximum over
the picture, as in the paper's section 3.2, and one linear layer chooses.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

MAP_SCALE_FLOOR = 0.05
"""Least scale of a channel of the feature maps; one that never changes must not become noise."""
JOINT_SCALE_FLOOR = 0.05
"""Least scale of a joint position [rad; m]: at rest they hardly differ, which means nothing."""


@contextmanager
def one_thread() -> Iterator[None]:
    """Run torch on one thread inside: sums get one order, and workers do not fight for cores."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


@dataclass(frozen=True)
class NetworkShape:
    """Sizes of a `DecisionNetwork`."""

    cameras: int
    """K, number of cameras."""
    channels: int
    """C, channels of the feature maps."""
    joints: int
    """J, number of joint positions; 0 without."""
    bottleneck: int
    """B, channels behind the bottleneck."""
    actions: int
    """A, sub-tasks to choose from."""


@dataclass(frozen=True)
class Moments:
    """Mean and standard deviation of the inputs of a network over its training set."""

    map_mean: NDArray[np.float64]  # (K, C)
    map_deviation: NDArray[np.float64]  # (K, C)
    joint_mean: NDArray[np.float64]  # (J,)
    joint_deviation: NDArray[np.float64]  # (J,)


class DecisionNetwork(nn.Module):
    """Feature maps (n, K, C, h, w) and joint positions (n, J) -> logits (n, A).

    The normaliser is part of the weights. Double precision, so that the order of a sum is not
    amplified by the optimiser: equal training sets give equal parameters.
    """

    map_mean: Tensor
    map_scale: Tensor
    joint_mean: Tensor
    joint_scale: Tensor

    def __init__(self, shape: NetworkShape, seed: int) -> None:
        """Draw the initial weights from a generator of their own, seeded with `seed`."""
        super().__init__()
        self.shape = shape
        maps, double = (shape.cameras, shape.channels, 1), torch.float64
        self.register_buffer("map_mean", torch.zeros(maps, dtype=double))
        self.register_buffer("map_scale", torch.ones(maps, dtype=double))
        self.register_buffer("joint_mean", torch.zeros(shape.joints, dtype=double))
        self.register_buffer("joint_scale", torch.ones(shape.joints, dtype=double))
        random = torch.Generator().manual_seed(seed)
        size = (shape.cameras, shape.bottleneck, shape.channels)
        start = torch.randn(size, generator=random, dtype=double) / shape.channels**0.5
        self.bottleneck = nn.Parameter(start)
        self.head = nn.Linear(
            shape.cameras * shape.bottleneck + shape.joints, shape.actions, dtype=double
        )
        # It begins undecided: every sub-task has the same chance.
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)

    def standardise(self, moments: Moments) -> None:
        """Set the normaliser from the moments of the training inputs."""
        self.map_mean.copy_(torch.from_numpy(moments.map_mean)[..., None])
        scale = np.hypot(moments.map_deviation, MAP_SCALE_FLOOR)
        self.map_scale.copy_(torch.from_numpy(scale)[..., None])
        self.joint_mean.copy_(torch.from_numpy(moments.joint_mean))
        scale = np.hypot(moments.joint_deviation, JOINT_SCALE_FLOOR)
        self.joint_scale.copy_(torch.from_numpy(scale))

    def forward(self, maps: Tensor, joints: Tensor) -> Tensor:
        """Return logits (n, A) float64."""
        pixels = maps.flatten(3).double()  # (n, K, C, h * w)
        seen = self.bottleneck @ ((pixels - self.map_mean) / self.map_scale)
        strongest = seen.amax(dim=3).flatten(1)  # (n, K * B)
        pose = (joints.double() - self.joint_mean) / self.joint_scale
        logits: Tensor = self.head(torch.cat([strongest, pose], dim=1))
        return logits
