"""The network of the joint level: what is seen, when, in which style -> the next targets.

A chunk of targets instead of one (Zhao et al., "Learning Fine-Grained Bimanual Manipulation with
Low-Cost Hardware", RSS 2023, section IV) lets every target be the mean of many predictions. The
time since the start of the episode is all the memory there is: while a hand rests or a gripper
closes, nothing that can be seen tells how long it has done so.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

SEEN_SCALE_FLOOR = 0.05
"""Least scale of a number of the state [its unit]: what hardly moves in the demonstrations must not
carry the network away when it is displaced by a few millimetres."""
MOVE_SCALE_FLOOR = 1e-3
"""Least scale of a target [rad or m]."""
FARTHEST = 5.0
"""Largest input of the network [scales]; beyond it nothing was learned."""
LAYERS = 3
PERIODS = 2.0 ** torch.arange(11, 2, -1)
"""Periods of the waves that tell the time [control steps]; no episode outlasts the longest."""


@dataclass(frozen=True)
class ChunkShape:
    """Sizes of a network of the joint level."""

    low_dim: int
    """S, numbers that are seen; the first J are the joint positions."""
    actions: int
    """J, joint targets."""
    chunk: int
    """H, control steps that are decided at once."""
    styles: int
    """D, styles to choose from, one per different demonstration."""
    style: int
    """Z, numbers that tell a style."""
    hidden: int
    """Width of the hidden layers."""


class ChunkNetwork(nn.Module):
    """State (n, S), style (n,) and time (n,) -> targets (n, H, J) [rad; m for grippers].

    Targets are learned relative to the present joint positions and by their own spread at each step
    of the chunk, so that a millimetre counts where motion is small. The normaliser is part of the
    weights.
    """

    kind: ClassVar[str] = "chunk"
    seen_mean: Tensor
    seen_scale: Tensor
    move_mean: Tensor
    move_scale: Tensor
    chances: Tensor
    errors: Tensor

    def __init__(self, shape: ChunkShape, seed: int) -> None:
        """Draw the initial weights from a generator of their own, seeded with `seed`."""
        super().__init__()
        self.shape = shape
        random = torch.Generator().manual_seed(seed)
        self.register_buffer("seen_mean", torch.zeros(shape.low_dim))
        self.register_buffer("seen_scale", torch.ones(shape.low_dim))
        self.register_buffer("move_mean", torch.zeros(shape.chunk, shape.actions))
        self.register_buffer("move_scale", torch.ones(shape.chunk, shape.actions))
        # Share of the weight that each style has, and how far its targets are missed.
        self.register_buffer("chances", torch.full((shape.styles,), 1 / shape.styles))
        self.register_buffer("errors", torch.zeros(shape.styles))
        self.styles = nn.Parameter(torch.randn(shape.styles, shape.style, generator=random))
        sizes = [shape.low_dim + shape.style + 2 * len(PERIODS), *[shape.hidden] * LAYERS]
        layers: list[nn.Module] = []
        for inputs, outputs in pairwise(sizes):
            layers += [_linear(inputs, outputs, random), nn.LayerNorm(outputs), nn.GELU()]
        layers.append(_linear(shape.hidden, shape.chunk * shape.actions, random))
        self.layers = nn.Sequential(*layers)

    @property
    def settings(self) -> Mapping[str, int]:
        """Nothing beside the shape."""
        return {}

    def standardise(
        self,
        seen: tuple[NDArray[np.float64], NDArray[np.float64]],
        moves: tuple[NDArray[np.float64], NDArray[np.float64]],
    ) -> None:
        """Set the normaliser from mean and deviation of what is `seen` (S,) and `moves` (H, J)."""
        self.seen_mean.copy_(torch.from_numpy(seen[0]))
        self.seen_scale.copy_(torch.from_numpy(np.hypot(seen[1], SEEN_SCALE_FLOOR)))
        self.move_mean.copy_(torch.from_numpy(moves[0]))
        self.move_scale.copy_(torch.from_numpy(np.hypot(moves[1], MOVE_SCALE_FLOOR)))

    def moves(self, low_dim: Tensor, style: Tensor, time: Tensor) -> Tensor:
        """Return the standardised moves (n, H, J) for `low_dim` (n, S) in the styles (n,).

        `time` (n,) is the number of control steps since the episode began.
        """
        seen = ((low_dim - self.seen_mean) / self.seen_scale).clamp(-FARTHEST, FARTHEST)
        told = self.layers(torch.cat([seen, self.styles[style], _waves(time)], dim=1))
        moves: Tensor = told.view(-1, self.shape.chunk, self.shape.actions)
        return moves

    def as_moves(self, low_dim: Tensor, targets: Tensor) -> Tensor:
        """Standardise `targets` (n, H, J) as seen from `low_dim` (n, S)."""
        return (targets - self._here(low_dim) - self.move_mean) / self.move_scale

    def forward(self, low_dim: Tensor, style: Tensor, time: Tensor) -> Tensor:
        """Return targets (n, H, J) [rad; m for grippers]."""
        moves = self.moves(low_dim, style, time)
        return moves * self.move_scale + self.move_mean + self._here(low_dim)

    def _here(self, low_dim: Tensor) -> Tensor:
        return low_dim[:, None, : self.shape.actions]


def _waves(time: Tensor) -> Tensor:
    """Tell times (n,) by the hands of clocks, (n, 2 P): one for each of P periods."""
    angles = 2 * math.pi * time[:, None] / PERIODS
    return torch.cat([angles.sin(), angles.cos()], dim=1)


def _linear(inputs: int, outputs: int, random: torch.Generator) -> nn.Linear:
    layer = nn.Linear(inputs, outputs)
    for parameter in layer.parameters():
        nn.init.uniform_(parameter, -(inputs**-0.5), inputs**-0.5, generator=random)
    return layer
