"""Behaviour cloning at the sub-task level: weighted maximum likelihood of the chosen sub-task.

The paper, section 4.3: the policy infers the next sub-task given the current state.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import cross_entropy

from filtering.vision.determinism import one_thread
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh, weighted_loss, weighted_moments
from policies.learners.networks import DecisionNetwork, NetworkShape
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError

STEPS_WITH_PICTURES = 120
"""Gradient steps that are enough for feature maps in several views."""
STEPS_FROM_STATE = 500
"""Gradient steps from the few numbers of the state, which tell less and cost little."""


@dataclass(frozen=True)
class BCConfig:
    """Settings of behaviour cloning."""

    bottleneck: int = 32
    """Channels per camera that the feature maps are reduced to."""
    steps: int | None = None
    """Gradient steps, each on all decisions in one of their views; None: STEPS_WITH_PICTURES, or
    STEPS_FROM_STATE where there are none."""
    learning_rate: float = 6e-3
    """Step size of AdamW."""
    weight_decay: float = 0.1
    """Decoupled weight decay of AdamW [1/step, times the learning rate]."""
    seed: int = 0
    """Seed of the initial weights."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        too_few = self.steps is not None and self.steps < 1
        if too_few or self.learning_rate <= 0 or self.weight_decay < 0:
            raise ConfigError(
                "A learner needs steps >= 1, learning_rate > 0 and weight_decay >= 0."
            )
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
        network = DecisionNetwork(shape_for(samples, self.config.bottleneck), self.config.seed)
        network.standardise(weighted_moments(samples, shares))
        self.history_ = clone(network, network, samples, shares, self.config)
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


def shape_for(samples: DecisionSamples, bottleneck: int) -> NetworkShape:
    """Sizes of a network that looks at `samples`."""
    return NetworkShape(
        cameras=samples.maps.shape[2],
        channels=samples.maps.shape[3],
        low_dim=samples.low_dim.shape[1],
        bottleneck=bottleneck,
        actions=samples.n_actions,
    )


def clone(
    network: nn.Module,
    logits_of: Callable[[Tensor, Tensor], Tensor],
    samples: DecisionSamples,
    shares: NDArray[np.float64],
    config: BCConfig,
) -> tuple[float, ...]:
    """Descend sum_i shares_i [-log pi(t_i | s_i)] and return its value before every step.

    `logits_of` (maps (n, K, C, h, w), state (n, S)) -> (n, A) asks `network`, whose parameters are
    changed; `shares` (n,) sum to 1.
    """
    optimizer = torch.optim.AdamW(
        network.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay
    )
    low_dim = torch.from_numpy(samples.low_dim.copy())
    labels = torch.from_numpy(samples.labels.copy())
    weights = torch.from_numpy(shares)
    history = []
    with one_thread():
        for step in range(config.steps or _usual_steps(samples)):
            maps = torch.from_numpy(samples.maps[:, step % samples.maps.shape[1]].copy())
            optimizer.zero_grad()
            losses = cross_entropy(logits_of(maps, low_dim), labels, reduction="none")
            loss = weighted_loss(losses, weights)
            loss.backward()
            optimizer.step()
            history.append(loss.item())
    return tuple(history)


def _usual_steps(samples: DecisionSamples) -> int:
    return STEPS_WITH_PICTURES if samples.spec.cameras else STEPS_FROM_STATE
