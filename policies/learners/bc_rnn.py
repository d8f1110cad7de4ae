"""Recurrent behaviour cloning: an LSTM reads the decisions of a demonstration in order.

BC-RNN of Mandlekar et al., "What Matters in Learning from Offline Human Demonstrations" (CoRL
2021), section 3: pi_theta(t_i | s_1, ..., s_i). The effect of a sub-task is not always visible
(sugar in the tea), so the next one is chosen from everything seen in the episode. The horizon is
the whole demonstration.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray

from policies.data.moments import weighted_moments
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh
from policies.learners.bc import BCConfig, clone, shape_for
from policies.learners.networks import RecurrentNetwork
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class BCRNNConfig(BCConfig):
    """Settings of recurrent behaviour cloning."""

    hidden: int = 64
    """H, size of the LSTM; Mandlekar et al. take 400 for hundreds of demonstrations."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        super().__post_init__()
        if self.hidden < 1:
            raise ConfigError(f"hidden is {self.hidden}; choose 1 or more.")


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
        samples, shares = weigh(samples, weights)
        shape = shape_for(samples, self.config.bottleneck)
        network = RecurrentNetwork(shape, self.config.seed, self.config.hidden)
        network.standardise(weighted_moments(samples, shares))
        episodes = torch.from_numpy(places(samples.demos))
        self.history_ = clone(network, samples, shares, self.config, episodes=episodes)
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


def places(demos: NDArray[np.int64]) -> NDArray[np.int64]:
    """Number of each row's demonstration (0, 1, ...) and the row's place in it, (n, 2)."""
    _, numbers = np.unique(demos, return_inverse=True)
    order = [np.count_nonzero(demos[:row] == demo) for row, demo in enumerate(demos)]
    return np.stack([numbers, np.array(order)], axis=1)
