"""Behavioural cloning from noisy demonstrations (Sasaki & Yamashina, ICLR 2021).

Algorithm 1: the demonstrations are divided into as many disjoint parts as the ensemble has members.
In every round each member is cloned anew from its part, with decisions weighted by their
probability under the ensemble of the previous round. A decision that only a minority of the
demonstrations takes loses weight, for most members have learned otherwise.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from filtering.vision.determinism import one_thread
from policies.data.moments import weighted_moments
from policies.data.samples import DecisionSamples
from policies.data.weighting import distinct, weigh
from policies.learners.bc import BCConfig, clone, shape_for
from policies.learners.networks import Ensemble
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class BCNDConfig(BCConfig):
    """Settings of behavioural cloning from noisy demonstrations."""

    steps: int = 120
    """Gradient steps of every member in every round, which begins with new initial weights."""
    members: int = 5
    """K, number of policies in the ensemble, each with a part of the demonstrations of its own; at
    most one per different demonstration."""
    rounds: int = 5
    """Number of rounds; the first is plain behaviour cloning."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        super().__post_init__()
        if self.members < 1 or self.rounds < 1:
            raise ConfigError("bcnd needs members >= 1 and rounds >= 1.")


class BCND:
    """minimise over theta, in rounds: - sum_i w_i pi_old(t_i | s_i) log pi_theta(t_i | s_i).

    pi_old is the ensemble after the previous round, 1 in the first. The products w_i pi_old are
    scaled to sum 1, which does not change the minimum.
    """

    policy_: SubtaskPolicy
    history_: tuple[float, ...]

    def __init__(self, config: BCNDConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or BCNDConfig()

    def fit(self, samples: DecisionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        config = self.config
        samples, shares, _ = distinct(*weigh(samples, weights))
        members = min(config.members, int(samples.demos.max()) + 1)
        parts = samples.demos % members
        moments = weighted_moments(samples, shares)
        seeds = np.random.SeedSequence(config.seed).generate_state(config.rounds).tolist()
        history: list[float] = []
        belief = np.ones(len(shares))
        for seed in seeds:
            network = Ensemble(shape_for(samples, config.bottleneck), seed, members)
            network.standardise(moments)
            losses = [
                _clone_part(member, samples, shares * belief, parts == part, config)
                for part, member in enumerate(network.members)
            ]
            history += np.mean(losses, axis=0).tolist()
            belief = _belief(network, samples)
        self.history_ = tuple(history)
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


def _clone_part(
    member: nn.Module,
    samples: DecisionSamples,
    products: NDArray[np.float64],
    mine: NDArray[np.bool_],
    config: BCNDConfig,
) -> tuple[float, ...]:
    """Clone `member` from the rows `mine` (n,), weighted by `products` (n,)."""
    return clone(member, samples.take(mine), products[mine] / products[mine].sum(), config)


def _belief(network: Ensemble, samples: DecisionSamples) -> NDArray[np.float64]:
    """Probability (n,) of the chosen sub-tasks under `network`, averaged over the views."""
    low_dim = torch.from_numpy(samples.low_dim.copy())
    rows = np.arange(len(samples.labels))
    with torch.inference_mode(), one_thread():
        chances = [
            network(torch.from_numpy(samples.maps[:, view].copy()), low_dim).softmax(dim=1).numpy()
            for view in range(samples.maps.shape[1])
        ]
    belief: NDArray[np.float64] = np.mean(chances, axis=0)[rows, samples.labels]
    return belief
