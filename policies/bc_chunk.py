"""Behaviour cloning at the joint level: chunks of joint targets in the style of a demonstration.

After ACT (Zhao et al., "Learning Fine-Grained Bimanual Manipulation with Low-Cost Hardware", RSS
2023): chunks, the L1 loss, a style variable, temporal ensembling. Instead of inferring the style as
ACT's variational encoder does, every demonstration has its own: there are few, and what they differ
in (tempo, path, pauses) lasts for the whole of one. The policy's memory is the time since the start
of the episode. The input noise shows the way back to the path.
"""

import hashlib
import math
from dataclasses import dataclass
from functools import partial
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from policies.chunk_network import ChunkNetwork, ChunkShape
from policies.motion_policy import MotionPolicy
from policies.motions import MotionSamples
from policies.networks import one_thread
from policies.weighting import weigh
from teasim.errors import ConfigError


@dataclass(frozen=True)
class BCChunkConfig:
    """Settings of behaviour cloning with chunks."""

    chunk: int = 16
    """H, control steps (0.1 s) decided at once."""
    style: int = 16
    """Z, numbers that tell the style of a demonstration."""
    hidden: int = 384
    """Width of the hidden layers."""
    noise: float = 0.02
    """Largest deviation of the input noise [spreads of the number in the pool]."""
    steps: int = 4500
    """Gradient steps."""
    batch: int = 256
    """Chunks per gradient step."""
    learning_rate: float = 1.5e-3
    """Largest step size of AdamW; it rises in the first tenth of the steps, then falls to 0."""
    weight_decay: float = 1e-4
    """Decoupled weight decay of AdamW [1/step, times the learning rate]."""
    seed: int = 0
    """Seed of the initial weights, of the batches and of the noise."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        if self.steps < 1 or self.learning_rate <= 0 or self.weight_decay < 0:
            raise ConfigError(
                "A learner needs steps >= 1, learning_rate > 0 and weight_decay >= 0."
            )
        if min(self.chunk, self.style, self.hidden, self.batch) < 1 or self.noise < 0:
            raise ConfigError("bc-chunk needs chunk, style, hidden and batch >= 1 and noise >= 0.")


@dataclass(frozen=True)
class Motions:
    """The different demonstrations of a pool, one after the other, n steps in all.

    Their order is that of their content, so that nothing depends on the order in the pool, and one
    that is there twice is the same as one of twice the weight.
    """

    low_dim: NDArray[np.float32]  # (n, S)
    targets: NDArray[np.float32]  # (n, J)
    stops: NDArray[np.int64]
    """Where each demonstration ends.  # (D,)"""
    shares: NDArray[np.float64]
    """Weight of all steps of each; sums to 1.  # (D,)"""

    @property
    def lengths(self) -> NDArray[np.int64]:
        """Steps of each demonstration, (D,)."""
        return np.diff(self.stops, prepend=0)

    @property
    def starts(self) -> NDArray[np.int64]:
        """Where each demonstration begins, (D,)."""
        return self.stops - self.lengths

    def draw(self, random: np.random.Generator, count: int) -> tuple[NDArray[np.int64], ...]:
        """Draw `count` steps by weight: their rows and their demonstrations, (count,) each."""
        edges = np.cumsum(self.shares)
        demos = np.searchsorted(edges, random.random(count) * edges[-1], side="right")
        lengths = self.lengths[demos]
        rows = self.starts[demos] + (random.random(count) * lengths).astype(np.int64)
        return rows, demos

    def chunks(
        self, rows: NDArray[np.int64], demos: NDArray[np.int64], length: int
    ) -> NDArray[np.float32]:
        """Return the next targets (m, length, J) from `rows` (m,) on; after the end, the last."""
        following = rows[:, None] + np.arange(length)
        chunks: NDArray[np.float32] = self.targets[
            np.minimum(following, self.stops[demos][:, None] - 1)
        ]
        return chunks


class BCChunk:
    """minimise over theta: sum_i w_i |a_i .. a_i+H-1 - pi_theta(s_i, style of the demo, i)|_1."""

    policy_: MotionPolicy
    history_: tuple[float, ...]

    def __init__(self, config: BCChunkConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or BCChunkConfig()

    def fit(self, samples: MotionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        samples, shares = weigh(samples, weights)
        motions = different_motions(samples, shares)
        config = self.config
        shape = ChunkShape(
            samples.spec.low_dim,
            len(samples.action_names),
            config.chunk,
            len(motions.stops),
            config.style,
            config.hidden,
        )
        with one_thread():
            network = ChunkNetwork(shape, config.seed)
            network.standardise(*_moments(motions, config.chunk))
            self.history_ = _descend(network, motions, config)
            _rate_styles(network, motions)
        self.policy_ = MotionPolicy(network, samples.spec, samples.action_names)
        return self


def different_motions(samples: MotionSamples, shares: NDArray[np.float64]) -> Motions:
    """Put the demonstrations in the order of their content, equal ones together."""
    rows_of: dict[bytes, NDArray[np.bool_]] = {}
    share_of: dict[bytes, float] = {}
    for demo in np.unique(samples.demos):
        rows = samples.demos == demo
        content = samples.low_dim[rows].tobytes() + samples.targets[rows].tobytes()
        key = hashlib.sha256(content).digest()
        rows_of[key] = rows
        share_of[key] = share_of.get(key, 0.0) + float(shares[rows].sum())
    keys = sorted(rows_of)
    return Motions(
        np.concatenate([samples.low_dim[rows_of[key]] for key in keys]),
        np.concatenate([samples.targets[rows_of[key]] for key in keys]),
        np.cumsum([np.count_nonzero(rows_of[key]) for key in keys]),
        np.array([share_of[key] for key in keys]),
    )


Moment = tuple[NDArray[np.float64], NDArray[np.float64]]


def _moments(motions: Motions, length: int) -> tuple[Moment, Moment]:
    """Mean and deviation of what is seen (S,), and of the moves (length, J) that follow it."""
    demos = np.repeat(np.arange(len(motions.stops)), motions.lengths)
    weights = (motions.shares / motions.lengths)[demos]
    here = motions.low_dim[:, : motions.targets.shape[1]]
    rows = np.arange(len(demos))
    moves = [
        _moment(motions.targets[np.minimum(rows + step, motions.stops[demos] - 1)] - here, weights)
        for step in range(length)
    ]
    means, deviations = (np.stack(parts) for parts in zip(*moves, strict=True))
    return _moment(motions.low_dim, weights), (means, deviations)


def _moment(numbers: NDArray[np.float32], weights: NDArray[np.float64]) -> Moment:
    """Mean and deviation of the columns of `numbers` (n, m) under `weights` (n,) that sum to 1."""
    exact = numbers.astype(np.float64)
    mean = weights @ exact
    return mean, np.sqrt(weights @ (exact - mean) ** 2)


def _descend(network: ChunkNetwork, motions: Motions, config: BCChunkConfig) -> tuple[float, ...]:
    """Train `network` and return the loss of every batch [spreads of a target]."""
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay
    )
    schedule = torch.optim.lr_scheduler.LambdaLR(optimizer, partial(_pace, steps=config.steps))
    random = np.random.default_rng(config.seed)
    history = []
    for _ in range(config.steps):
        rows, demos = motions.draw(random, config.batch)
        exact = torch.from_numpy(motions.low_dim[rows])
        seen = exact + config.noise * network.seen_scale * _noise(exact.shape, random)
        chunks = torch.from_numpy(motions.chunks(rows, demos, config.chunk))
        optimizer.zero_grad()
        course = torch.from_numpy(demos), torch.from_numpy(rows - motions.starts[demos])
        loss = (network.moves(seen, *course) - network.as_moves(seen, chunks)).abs().mean()
        loss.backward()
        optimizer.step()
        schedule.step()
        history.append(loss.item())
    return tuple(history)


def _pace(step: int, steps: int) -> float:
    """Share of the learning rate: up during the first tenth of the steps, then down to 0."""
    return min(1.0, (step + 1) / (0.1 * steps)) * 0.5 * (1 + math.cos(math.pi * step / steps))


def _noise(shape: torch.Size, random: np.random.Generator) -> Tensor:
    """Noise (n, S) of another strength in every row, so that small deviations are learned well."""
    strength = random.random((shape[0], 1))
    return torch.from_numpy((strength * random.standard_normal(shape)).astype(np.float32))


def _rate_styles(network: ChunkNetwork, motions: Motions) -> None:
    """Note in `network` the weight of every style and how far its targets are missed."""
    chances = motions.shares / motions.lengths
    network.chances.copy_(torch.from_numpy(chances / chances.sum()))
    for demo, (start, stop) in enumerate(zip(motions.starts, motions.stops, strict=True)):
        rows = np.arange(start, stop)
        demos = np.full(len(rows), demo)
        seen = torch.from_numpy(motions.low_dim[rows])
        chunks = torch.from_numpy(motions.chunks(rows, demos, network.shape.chunk))
        with torch.no_grad():
            course = torch.from_numpy(demos), torch.from_numpy(rows - start)
            missed = network.moves(seen, *course) - network.as_moves(seen, chunks)
        network.errors[demo] = missed.abs().mean()
