"""The networks that score sub-tasks, independent of where objects are in the picture.

Objects are placed differently in every demonstration, and a few dozen decisions are too few to
learn every placement. So the feature maps of each camera go through a 1x1 bottleneck and a maximum
over the picture, as in section 3.2 of the paper, and one linear layer scores the sub-tasks.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import ClassVar, Protocol

import numpy as np
import torch
from torch import Tensor, nn

from policies.data.moments import Moments

MAP_SCALE_FLOOR = 0.05
"""Least scale of a channel of the feature maps, so that a constant channel is not amplified."""
LOW_DIM_SCALE_FLOOR = 0.2
"""Least scale of a number of the state [its unit]: joint positions at rest hardly vary, and the
placement of objects varies by a few centimetres, neither of which decides the next sub-task."""

HiddenState = tuple[Tensor, ...]
"""What a network carries from one decision of an episode to the next, (n, H) each; () if nothing.
"""


@dataclass(frozen=True)
class NetworkShape:
    """Sizes of a network that chooses sub-tasks."""

    cameras: int
    """K, number of cameras; 0 when the policy sees the state alone."""
    channels: int
    """C, channels of the feature maps."""
    low_dim: int
    """S, numbers of the state besides the pictures; may be 0."""
    bottleneck: int
    """B, channels after the bottleneck; 0: no bottleneck, all C channels are kept."""
    actions: int
    """A, sub-tasks to choose from."""

    @property
    def features(self) -> int:
        """F, length of the encoded observation."""
        return self.cameras * (self.bottleneck or self.channels) + self.low_dim


class SubtaskNetwork(Protocol):
    """What a policy needs of its network."""

    kind: ClassVar[str]
    """Name under which it is saved."""
    shape: NetworkShape
    """Its sizes."""

    @property
    def settings(self) -> Mapping[str, int]:
        """Arguments besides shape and seed that are needed to build it again."""

    def step(
        self, maps: Tensor, low_dim: Tensor, hidden: HiddenState | None
    ) -> tuple[Tensor, HiddenState]:
        """Return logits (n, A) for a decision in each of n episodes, and the next hidden state."""

    def eval(self) -> nn.Module: ...  # noqa: D102  (torch's)

    def state_dict(self) -> dict[str, Tensor]: ...  # noqa: D102  (torch's)


class Encoder(nn.Module):
    """Feature maps (n, K, C, h, w) and state (n, S) -> features (n, F).

    The normaliser is part of the weights. Double precision keeps the optimiser from amplifying
    rounding differences in the order of sums, so equal training sets give equal parameters.
    """

    map_mean: Tensor
    map_scale: Tensor
    low_dim_mean: Tensor
    low_dim_scale: Tensor

    def __init__(self, shape: NetworkShape, random: torch.Generator) -> None:
        """Draw the bottleneck, where there is one, from `random`."""
        super().__init__()
        maps, double = (shape.cameras, shape.channels, 1), torch.float64
        self.register_buffer("map_mean", torch.zeros(maps, dtype=double))
        self.register_buffer("map_scale", torch.ones(maps, dtype=double))
        self.register_buffer("low_dim_mean", torch.zeros(shape.low_dim, dtype=double))
        self.register_buffer("low_dim_scale", torch.ones(shape.low_dim, dtype=double))
        self.bottleneck: nn.Parameter | None = None
        if shape.bottleneck and shape.cameras:
            size = (shape.cameras, shape.bottleneck, shape.channels)
            start = torch.randn(size, generator=random, dtype=double) / shape.channels**0.5
            self.bottleneck = nn.Parameter(start)

    def standardise(self, moments: Moments) -> None:
        """Set the normaliser from the moments of the training inputs."""
        self.map_mean.copy_(torch.from_numpy(moments.map_mean)[..., None])
        scale = np.hypot(moments.map_deviation, MAP_SCALE_FLOOR)
        self.map_scale.copy_(torch.from_numpy(scale)[..., None])
        self.low_dim_mean.copy_(torch.from_numpy(moments.low_dim_mean))
        scale = np.hypot(moments.low_dim_deviation, LOW_DIM_SCALE_FLOOR)
        self.low_dim_scale.copy_(torch.from_numpy(scale))

    def forward(self, maps: Tensor, low_dim: Tensor) -> Tensor:
        """Return features (n, F) float64."""
        seen = (maps.flatten(3).double() - self.map_mean) / self.map_scale  # (n, K, C, h * w)
        if self.bottleneck is not None:
            seen = self.bottleneck @ seen
        strongest = seen.amax(dim=3).flatten(1)  # (n, K * B)
        numbers = (low_dim.double() - self.low_dim_mean) / self.low_dim_scale
        return torch.cat([strongest, numbers], dim=1)


class Memoryless(nn.Module):
    """A network whose logits depend on the current observation alone."""

    def step(
        self,
        maps: Tensor,
        low_dim: Tensor,
        hidden: HiddenState | None,  # noqa: ARG002  (the protocol's)
    ) -> tuple[Tensor, HiddenState]:
        """Return logits (n, A) and an empty hidden state."""
        return self(maps, low_dim), ()


class DecisionNetwork(Memoryless):
    """Feature maps (n, K, C, h, w) and state (n, S) -> logits (n, A)."""

    kind: ClassVar[str] = "decision"

    def __init__(self, shape: NetworkShape, seed: int) -> None:
        """Draw the initial weights from a generator of their own, seeded with `seed`."""
        super().__init__()
        self.shape = shape
        self.encoder = Encoder(shape, torch.Generator().manual_seed(seed))
        self.head = undecided_head(shape.features, shape.actions)

    @property
    def settings(self) -> Mapping[str, int]:
        """Nothing is needed besides the shape."""
        return {}

    def standardise(self, moments: Moments) -> None:
        """Set the normaliser from the moments of the training inputs."""
        self.encoder.standardise(moments)

    def forward(self, maps: Tensor, low_dim: Tensor) -> Tensor:
        """Return logits (n, A) float64."""
        logits: Tensor = self.head(self.encoder(maps, low_dim))
        return logits


class Ensemble(Memoryless):
    """Networks whose probabilities are averaged."""

    kind: ClassVar[str] = "ensemble"

    def __init__(self, shape: NetworkShape, seed: int, members: int) -> None:
        """Draw the initial weights of each member from `seed` and its number."""
        super().__init__()
        self.shape = shape
        seeds = np.random.SeedSequence(seed).generate_state(members).tolist()
        self.members = nn.ModuleList(DecisionNetwork(shape, number) for number in seeds)

    @property
    def settings(self) -> Mapping[str, int]:
        """Number of members."""
        return {"members": len(self.members)}

    def standardise(self, moments: Moments) -> None:
        """Set the normaliser of every member from the moments of the training inputs."""
        for member in self.members:
            member.standardise(moments)  # type: ignore[operator]

    def forward(self, maps: Tensor, low_dim: Tensor) -> Tensor:
        """Return logits (n, A) float64, the logarithm of the mean probability."""
        votes = torch.stack([member(maps, low_dim).log_softmax(dim=1) for member in self.members])
        return votes.logsumexp(dim=0) - math.log(len(votes))


@dataclass(frozen=True)
class Memory:
    """Sizes of the memory of a recurrent network."""

    hidden: int
    """H, size of each layer of the LSTM."""
    layers: int = 1
    """L, number of layers."""
    horizon: int = 0
    """Decisions after which the memory is cleared; 0: never within an episode."""


class RecurrentNetwork(nn.Module):
    """Decisions of an episode in order -> logits; an LSTM encodes what was seen before."""

    kind: ClassVar[str] = "recurrent"

    def __init__(self, shape: NetworkShape, seed: int, **memory: int) -> None:
        """Draw the initial weights from `seed`; `memory` has the fields of `Memory`."""
        super().__init__()
        self.shape = shape
        self.memory = Memory(**memory)
        hidden = self.memory.hidden
        random = torch.Generator().manual_seed(seed)
        self.encoder = Encoder(shape, random)
        self.lstm = nn.LSTM(
            shape.features, hidden, self.memory.layers, batch_first=True, dtype=torch.float64
        )
        for parameter in self.lstm.parameters():
            nn.init.uniform_(parameter, -(hidden**-0.5), hidden**-0.5, generator=random)
        self.head = undecided_head(hidden, shape.actions)

    @property
    def settings(self) -> Mapping[str, int]:
        """Sizes of the memory."""
        return asdict(self.memory)

    def standardise(self, moments: Moments) -> None:
        """Set the normaliser from the moments of the training inputs."""
        self.encoder.standardise(moments)

    def forward(self, maps: Tensor, low_dim: Tensor, episodes: Tensor) -> Tensor:
        """Return logits (n, A) float64 of n decisions.

        `episodes` (n, 2) holds each decision's episode (numbered 0, 1, ...) and its place in it.
        """
        features = self.encoder(maps, low_dim)
        count, length = (episodes.amax(dim=0) + 1).tolist()
        padded = features.new_zeros(count, length, features.shape[1])
        padded[episodes[:, 0], episodes[:, 1]] = features
        remembered, _ = self.lstm(padded)
        logits: Tensor = self.head(remembered[episodes[:, 0], episodes[:, 1]])
        return logits

    def step(
        self, maps: Tensor, low_dim: Tensor, hidden: HiddenState | None
    ) -> tuple[Tensor, HiddenState]:
        """Return logits (n, A) and what is remembered.

        It is the output of the layers (n, L * H), their cells (n, L * H), and, with a horizon, the
        number of decisions since the memory was cleared (n, 1).
        """
        features = self.encoder(maps, low_dim)[:, None]
        taken = features.new_zeros(len(features), 1)
        if hidden is not None and self.memory.horizon:
            hidden = cleared(hidden, self.memory.horizon)
            taken = hidden[-1]
        remembered, after = self.lstm(features, None if hidden is None else self._layers(hidden))
        output, cell = (part.transpose(0, 1).flatten(1) for part in after)
        counted = (taken + 1,) if self.memory.horizon else ()
        return self.head(remembered[:, 0]), (output, cell, *counted)

    def _layers(self, hidden: HiddenState) -> tuple[Tensor, Tensor]:
        """Return output and cell as the LSTM takes them, (L, n, H) each."""
        output, cell = (
            part.reshape(len(part), self.memory.layers, -1).transpose(0, 1).contiguous()
            for part in hidden[:2]
        )
        return output, cell


def cleared(hidden: HiddenState, horizon: int) -> HiddenState:
    """Return a hidden state, 0 where its last part (n, 1), the steps, has come to `horizon`."""
    goes_on = hidden[-1] < horizon
    return tuple(part * goes_on for part in hidden)


def undecided_head(features: int, actions: int) -> nn.Linear:
    """Return a layer (n, F) -> (n, A) with zero weights: all sub-tasks start equally probable."""
    head = nn.Linear(features, actions, dtype=torch.float64)
    nn.init.zeros_(head.weight)
    nn.init.zeros_(head.bias)
    return head
