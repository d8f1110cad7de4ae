"""Recurrent behaviour cloning: an LSTM reads the decisions of a demonstration in order.

BC-RNN of Mandlekar et al., "What Matters in Learning from Offline Human Demonstrations" (CoRL
2021), section 3: pi_theta(t_i | s_(i-h+1), ..., s_i). The effect of a sub-task is not always
visible (sugar in the tea), so the next one is chosen from what was seen before. Mandlekar et al.
take two layers of 400 units and a horizon of 10 control steps:

    teasim train pool --learner bc-rnn --set hidden=400 --set layers=2 --set horizon=10 -o policy

By default the horizon is the whole demonstration, which has about seven decisions.
"""

from dataclasses import asdict, dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray

from policies.data.moments import weighted_moments
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh
from policies.learners.bc import BCConfig, clone, shape_for
from policies.learners.networks import Memory, RecurrentNetwork
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class BCRNNConfig(BCConfig):
    """Settings of recurrent behaviour cloning."""

    hidden: int = 64
    """H, size of each layer of the LSTM; Mandlekar et al. take 400 for hundreds of
    demonstrations."""
    layers: int = 1
    """Number of layers of the LSTM; Mandlekar et al. take 2."""
    horizon: int | None = None
    """Decisions after which the memory is cleared, in training and in use; it is trained on all
    windows of this length. None: the whole episode."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        super().__post_init__()
        if min(self.hidden, self.layers) < 1:
            raise ConfigError("bc-rnn needs hidden >= 1 and layers >= 1.")
        if self.horizon is not None and self.horizon < 1:
            raise ConfigError(f"horizon is {self.horizon}; choose 1 or more, or none.")


class BCRNN:
    """minimise over theta: sum_i w_i [-log pi_theta(t_i | s_1 .. s_i)], with sum_i w_i = 1."""

    policy_: SubtaskPolicy
    history_: tuple[float, ...]

    def __init__(self, config: BCRNNConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or BCRNNConfig()

    def fit(self, samples: DecisionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        config = self.config
        samples, shares = weigh(samples, weights)
        shape = shape_for(samples, config.bottleneck)
        memory = Memory(config.hidden, config.layers, config.horizon or 0)
        network = RecurrentNetwork(shape, config.seed, **asdict(memory))
        network.standardise(weighted_moments(samples, shares))
        rows, found = windows(places(samples.demos), config.horizon)
        samples, shares = samples.take(rows), shares[rows] / np.bincount(rows)[rows]
        episodes = torch.from_numpy(found)
        self.history_ = clone(network, samples, shares, self.config, episodes=episodes)
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


def windows(
    places: NDArray[np.int64], horizon: int | None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut demonstrations into all their windows of `horizon` decisions; None: into themselves.

    Args:
        places: number of each decision's demonstration and its place in it, (n, 2).
        horizon: length of a window; a shorter demonstration is a window.

    Returns:
        The decision of every row, (m,), and the number of its window and its place there, (m, 2).
    """
    if horizon is None:
        return np.arange(len(places)), places
    rows, found, count = [], [], 0
    for demo in range(int(places[:, 0].max()) + 1):
        own = np.flatnonzero(places[:, 0] == demo)
        own = own[np.argsort(places[own, 1])]
        for start in range(max(len(own) - horizon, 0) + 1):
            window = own[start : start + horizon]
            rows.append(window)
            found.append(np.stack([np.full(len(window), count), np.arange(len(window))], axis=1))
            count += 1
    return np.concatenate(rows), np.concatenate(found)


def places(demos: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number of each row's demonstration (0, 1, ...) and the row's place in it, (n, 2)."""
    _, numbers = np.unique(demos, return_inverse=True)
    order = [np.count_nonzero(demos[:row] == demo) for row, demo in enumerate(demos)]
    return np.stack([numbers, np.array(order)], axis=1)
