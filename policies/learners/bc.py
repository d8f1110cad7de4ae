"""Behaviour cloning at the sub-task level: weighted maximum likelihood of the chosen sub-task.

The paper, section 4.3: the policy infers the next sub-task given the current state.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import cross_entropy

from filtering.vision.determinism import one_thread
from policies.data.moments import weighted_moments
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh, weighted_loss
from policies.learners.networks import DecisionNetwork, NetworkShape
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError

STEPS_WITH_PICTURES = 600
"""Default number of gradient steps with feature maps in several views: after 120, one sampled
decision in fifty is another than the likeliest one (docs/results.md)."""
STEPS_FROM_STATE = 500
"""Default number of gradient steps from the state alone, which needs more and cheaper steps."""


@dataclass(frozen=True)
class BCConfig:
    """Settings of behaviour cloning."""

    bottleneck: int = 32
    """Channels per camera after the 1x1 bottleneck."""
    steps: int | None = None
    """Gradient steps, each on all decisions in one of their views; None: 600 with pictures, 500
    from the state alone."""
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

    Every step takes all decisions, in one view after the other, on one thread, so a seed and a set
    of weighted decisions determine the result.
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
        self.history_ = clone(network, samples, shares, self.config)
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


def shape_for(samples: DecisionSamples, bottleneck: int) -> NetworkShape:
    """Sizes of a network for `samples`."""
    return NetworkShape(
        cameras=samples.maps.shape[2],
        channels=samples.maps.shape[3],
        low_dim=samples.low_dim.shape[1],
        bottleneck=bottleneck,
        actions=samples.n_actions,
    )


def clone(
    network: nn.Module,
    samples: DecisionSamples,
    shares: NDArray[np.float64],
    config: BCConfig,
    **inputs: Tensor,
) -> tuple[float, ...]:
    """Minimise sum_i shares_i [-log pi(t_i | s_i)] and return its value before every step.

    Args:
        network: (maps (n, K, C, h, w), state (n, S), **inputs) -> logits (n, A); its parameters are
            changed.
        samples: n decisions.
        shares: share of the total weight of each decision, (n,), sum 1.
        config: number of steps and settings of the optimiser.
        inputs: further inputs of the network, the same in every step.
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
            losses = cross_entropy(network(maps, low_dim, **inputs), labels, reduction="none")
            loss = weighted_loss(losses, weights)
            loss.backward()
            optimizer.step()
            history.append(loss.item())
    return tuple(history)


def _usual_steps(samples: DecisionSamples) -> int:
    return STEPS_WITH_PICTURES if samples.spec.cameras else STEPS_FROM_STATE
