"""Recurrent behaviour cloning of joint targets: an LSTM reads the states of an episode in order.

BC-RNN of Mandlekar et al., "What Matters in Learning from Offline Human Demonstrations" (CoRL
2021), with chunks and an L1 loss as in `act`. The hidden state is carried from window to window
through a whole demonstration, as it is through an episode, and gradients stay in a window.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import cross_entropy

from policies.data.motions import MotionSamples
from policies.learners.joints.chunk_policy import ChunkPolicy
from policies.learners.joints.cloning import Draws, set_scales, shape_for
from policies.learners.joints.descent import PlanConfig, descend
from policies.learners.joints.networks import HiddenState
from policies.learners.joints.recurrent import RecurrentPlanNetwork
from policies.learners.joints.steps.rows import Rows, prepare
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class JointBCRNNConfig(PlanConfig):
    """Settings of recurrent behaviour cloning of joint targets."""

    chunk: int = 8
    """K, control steps (0.1 s) planned ahead."""
    batch: int = 16
    """Demonstrations that are read side by side."""
    window: int = 16
    """Control steps of each that are read in a gradient step."""
    hidden: int = 256
    """H, size of the LSTM."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        super().__post_init__()
        if self.hidden < 1 or self.window < 1:
            raise ConfigError("bc-rnn needs hidden >= 1 and window >= 1.")


class JointBCRNN:
    """minimise over theta: sum_i w_i |a_i..i+K - plan_theta(s_1 .. s_i)|_1, with sum_i w_i = 1."""

    policy_: ChunkPolicy
    history_: tuple[float, ...]

    def __init__(self, config: JointBCRNNConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or JointBCRNNConfig()

    def fit(self, samples: MotionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        config, rows = self.config, prepare(samples, weights, timed=False)
        shape = shape_for(rows, int(rows.subtasks.max()) + 1, config)
        network = RecurrentPlanNetwork(shape, config.seed, config.ensemble, config.hidden)
        set_scales(network, rows, Draws(rows, 1, config))
        windows = Windows(rows, config)

        def loss(_: int) -> Tensor:
            chosen, counts, before = windows.take()
            given = torch.from_numpy(rows.given[chosen.ravel()]).view(*chosen.shape, -1)
            logits, planned, after = network(network.normaliser.inputs(given), before)
            windows.keep(after)
            wanted = torch.from_numpy(rows.planned(chosen.ravel(), config.chunk))
            wanted = network.normaliser.targets(wanted).view_as(planned)
            missed = (planned - wanted).abs().mean(dim=(2, 3))
            labels = torch.from_numpy(rows.subtasks[chosen])
            told = cross_entropy(logits.transpose(1, 2), labels, reduction="none")
            return ((missed + told) * counts).sum() / counts.sum()

        self.history_ = descend(network, loss, config)
        self.policy_ = ChunkPolicy(network, samples.spec, samples.action_names)
        return self


class Windows:
    """Demonstrations that are read side by side, one window after the other."""

    def __init__(self, rows: Rows, config: JointBCRNNConfig) -> None:
        """Begin each of the demonstrations at a random step."""
        self._random = np.random.default_rng(config.seed)
        self._rows, self._ahead = rows, np.arange(config.window)
        self._chances = np.cumsum(rows.shares)
        self._demos = self._draw(config.batch)
        lengths = rows.stops[self._demos] - rows.starts[self._demos]
        begun = (self._random.random(config.batch) * lengths).astype(np.int64)
        self._next = rows.starts[self._demos] + begun
        zeros = torch.zeros(config.batch, config.hidden)
        self._hidden: HiddenState = (zeros, zeros)

    def take(self) -> tuple[NDArray[np.int64], Tensor, HiddenState]:
        """Return rows (n, T), which of them count (n, T), and the hidden states before them.

        Where a demonstration ends, the rest of the window does not count, and another one begins.
        """
        rows = self._next[:, None] + self._ahead
        stops = self._rows.stops[self._demos]
        counts = rows < stops[:, None]
        before = self._hidden
        self._next = rows[:, -1] + 1
        over = self._next >= stops
        self._demos[over] = self._draw(int(over.sum()))
        self._next[over] = self._rows.starts[self._demos[over]]
        self._going = torch.from_numpy(~over)[:, None]
        counted = torch.from_numpy(counts.astype(np.float32))
        return np.minimum(rows, stops[:, None] - 1), counted, before

    def keep(self, hidden: HiddenState) -> None:
        """Carry the hidden states after a window on, but for demonstrations that have ended."""
        self._hidden = tuple((part.detach() * self._going) for part in hidden)

    def _draw(self, count: int) -> NDArray[np.int64]:
        drawn = self._random.random(count) * self._chances[-1]
        return np.searchsorted(self._chances, drawn, side="right")
