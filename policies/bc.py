"""Behaviour cloning at the sub-task level: weighted maximum likelihood of the chosen sub-task.

The paper, section 4.3: the policy infers the next sub-task given the current state.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch.nn.functional import cross_entropy

from policies.base import DecisionSamples
from policies.networks import DecisionNetwork, one_thread
from policies.subtask_policy import SubtaskPolicy
from policies.weighting import weigh, weighted_loss, weighted_moments
from teasim.errors import ConfigError


@dataclass(frozen=True)
class BCConfig:
    """Settings of behaviour cloning."""

    hidden: tuple[int, ...] = (64,)
    """Units of the hidden layers."""
    steps: int = 200
    """Full-batch gradient steps."""
    learning_rate: float = 1e-3
    """Step size of AdamW."""
    weight_decay: float = 0.1
    """Decoupled weight decay of AdamW [1/step, times the learning rate]."""
    seed: int = 0
    """Seed of the initial weights."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        if self.steps < 1 or self.learning_rate <= 0 or self.weight_decay < 0:
            raise ConfigError("bc needs steps >= 1, learning_rate > 0 and weight_decay >= 0.")
        if any(units < 1 for units in self.hidden):
            raise ConfigError(f"Every hidden layer needs a unit or more, not {self.hidden}.")


class BC:
    """minimise over theta: sum_i w_i [-log pi_theta(t_i | s_i)], with sum_i w_i = 1.

    Full batch on one thread, so a seed and a set of weighted decisions give one result.
    """

    policy_: SubtaskPolicy
    history_: tuple[float, ...]

    def __init__(self, config: BCConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or BCConfig()

    def fit(self, samples: DecisionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        samples, shares = weigh(samples, weights)
        network = DecisionNetwork(
            samples.inputs.shape[1], self.config.hidden, samples.n_actions, self.config.seed
        )
        network.standardise(*weighted_moments(samples.inputs, shares))
        with one_thread():
            self.history_ = self._descend(network, samples, shares)
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self

    def _descend(
        self, network: DecisionNetwork, samples: DecisionSamples, shares: NDArray[np.float64]
    ) -> tuple[float, ...]:
        optimizer = torch.optim.AdamW(
            network.parameters(),
            lr=self.config.learning_rate,
            weight_decay=self.config.weight_decay,
        )
        inputs = torch.from_numpy(samples.inputs.copy())
        labels = torch.from_numpy(samples.labels.copy())
        weights = torch.from_numpy(shares)
        history = []
        for _ in range(self.config.steps):
            optimizer.zero_grad()
            losses = cross_entropy(network(inputs), labels, reduction="none")
            loss = weighted_loss(losses, weights)
            loss.backward()
            optimizer.step()
            history.append(loss.item())
        return tuple(history)
