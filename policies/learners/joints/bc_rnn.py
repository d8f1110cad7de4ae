"""Recurrent behaviour cloning of joint targets: an LSTM reads the last states in order.

BC-RNN of Mandlekar et al., "What Matters in Learning from Offline Human Demonstrations" (CoRL
2021), with chunks and an L1 loss as in `act`. As there, the memory is cleared after a horizon, in
training and in use: carried through a whole episode, it holds states that no demonstration showed.
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
from policies.learners.joints.cloning import Draws, prepare_network, shape_for
from policies.learners.joints.descent import PlanConfig, descend
from policies.learners.joints.recurrent import RecurrentPlanNetwork
from policies.learners.joints.steps.rows import Rows, prepare
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class JointBCRNNConfig(PlanConfig):
    """Settings of recurrent behaviour cloning of joint targets."""

    chunk: int = 8
    """K, control steps (0.1 s) planned ahead."""
    batch: int = 8
    """Windows per sub-task in a gradient step."""
    horizon: int = 10
    """Control steps after which the memory is cleared; Mandlekar et al. take 10."""
    hidden: int = 64
    """H, size of the LSTM; Mandlekar et al. take two layers of 400."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        super().__post_init__()
        if self.hidden < 1 or self.horizon < 1:
            raise ConfigError("bc-rnn needs hidden >= 1 and horizon >= 1.")


class JointBCRNN:
    """minimise over theta: sum_i w_i |a_i..i+K - plan_theta(s_i-h+1 .. s_i)|_1, sum_i w_i = 1."""

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
        config, rows = self.config, prepare(samples, weights, timed=True)
        subtasks = int(rows.subtasks.max()) + 1
        shape, draws = shape_for(rows, subtasks, config), Draws(rows, subtasks, config)
        network = RecurrentPlanNetwork(
            shape, config.seed, config.ensemble, config.hidden, config.horizon
        )
        prepare_network(network, rows, draws)

        def loss(_: int) -> Tensor:
            chosen, counts = windows(rows, draws.batch().ravel(), config.horizon)
            given = network.normaliser.inputs(torch.from_numpy(rows.given[chosen]))
            seen = network.read(given, None)[0].flatten(0, 1)
            planned = network(seen.view(subtasks, -1, seen.shape[1])).flatten(0, 1)
            wanted = torch.from_numpy(rows.planned(chosen.ravel(), config.chunk))
            missed = (planned - network.normaliser.targets(wanted)).abs().mean(dim=(1, 2))
            labels = torch.from_numpy(rows.subtasks[chosen.ravel()])
            told = cross_entropy(network.tell(seen), labels, reduction="none")
            return ((missed + told) * counts.ravel()).sum() / counts.sum()

        self.history_ = descend(network, loss, config)
        self.policy_ = ChunkPolicy(network, samples.spec, samples.action_names)
        return self


def windows(rows: Rows, first: NDArray[np.int64], horizon: int) -> tuple[NDArray[np.int64], Tensor]:
    """Return rows (n, T) from `first` (n,) on, and which of them count (n, T).

    Where a demonstration ends, the rest of its window does not count.
    """
    ahead, last = first[:, None] + np.arange(horizon), rows.last(first)[:, None]
    counts = torch.from_numpy((ahead <= last).astype(np.float32))
    return np.minimum(ahead, last), counts
