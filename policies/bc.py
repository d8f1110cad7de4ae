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
from policies.networks import DecisionNetwork, NetworkShape, one_thread
from policies.subtask_policy import SubtaskPolicy
from policies.weighting import weigh, weighted_loss, weighted_moments
from teasim.errors import ConfigError


@dataclass(frozen=True)
class BCConfig:
    """Settings of behaviour cloning."""

    bottleneck: int = 32
    """Channels per camera that the feature maps are reduced to."""
    steps: int = 120
    """Gradient steps, each on all decisions in one of their views."""
    learning_rate: float = 6e-3
    """Step size of AdamW."""
    weight_decay: float = 0.1
    """Decoupled weight decay of AdamW [1/step, times the learning rate]."""
    seed: int = 0
    """Seed of the initial weights."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        if self.steps < 1 or self.learning_rate <= 0 or self.weight_decay < 0:
            raise ConfigError("bc needs steps >= 1, learning_rate > 0 and weight_decay >= 0.")
        if self.bottleneck < 1:
            raise ConfigError(f"bottleneck is {self.bottleneck}; choose 1 or more.")


class BC:
    """minimise over theta: sum_i w_i [-log pi_theta(t_i | s_i)], with sum_i w_i = 1.

    Every step takes all decisions, in one of their views after the other, on one thread: a seed and
    a set of weighted decisions give one result.
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
        shape = NetworkShape(
            cameras=samples.maps.shape[2],
            channels=samples.maps.shape[3],
            joints=samples.joints.shape[1],
            bottleneck=self.config.bottleneck,
            actions=samples.n_actions,
        )
        network = DecisionNetwork(shape, self.config.seed)
        network.standardise(weighted_moments(samples, shares))
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
        joints = torch.from_numpy(samples.joints.copy())
        labels = torch.from_numpy(samples.labels.copy())
        weights = torch.from_numpy(shares)
        history = []
        for step in range(self.config.steps):
            maps = torch.from_numpy(samples.maps[:, step % samples.maps.shape[1]].copy())
            optimizer.zero_grad()
            losses = cross_entropy(network(maps, joints), labels, reduction="none")
            loss = weighted_loss(losses, weights)
            loss.backward()
            optimizer.step()
            history.append(loss.item())
        return tuple(history)
