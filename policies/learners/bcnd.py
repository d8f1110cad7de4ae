"""Behavioural cloning from noisy demonstrations (Sasaki & Yamashina, ICLR 2021).

Algorithm 1: an ensemble is cloned in rounds, and each round weights a decision by its probability
under the ensemble of the previous round, so decisions of a minority lose weight. Sasaki & Yamashina
give every member a part of the data of its own; here every member is trained on all of it and
differs by its initial weights, because a dozen demonstrations are too few to divide by five.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray

from filtering.vision.determinism import one_thread
from policies.data.moments import weighted_moments
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh
from policies.learners.bc import BCConfig, clone, shape_for
from policies.learners.networks import Ensemble
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class BCNDConfig(BCConfig):
    """Settings of behavioural cloning from noisy demonstrations."""

    steps: int = 40
    """Gradient steps of every member in every round; a round continues from the previous one."""
    members: int = 5
    """Number of policies in the ensemble."""
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
        samples, shares = weigh(samples, weights)
        shape = shape_for(samples, config.bottleneck)
        network = Ensemble(shape, config.seed, config.members)
        network.standardise(weighted_moments(samples, shares))
        history: list[float] = []
        belief = np.ones(len(shares))
        for _ in range(config.rounds):
            products = shares * belief
            losses = [
                clone(member, samples, products / products.sum(), config)
                for member in network.members
            ]
            history += np.mean(losses, axis=0).tolist()
            belief = _belief(network, samples)
        self.history_ = tuple(history)
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


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
