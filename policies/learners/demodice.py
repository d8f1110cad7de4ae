"""DemoDICE (Kim et al., ICLR 2022): imitation from a few expert and many supplementary demos.

The demonstrations E are known to be good; U is the union of all demonstrations. The method seeks a
policy whose stationary distribution d is close to that of E without leaving that of U,

    max over d of  - KL(d || d_E) - alpha KL(d || d_U) .

Three problems are solved one after the other:

    (1) c:   min  - E_E[log c(s,a)] - E_U[log(1 - c(s,a))] + penalty E_U[(|grad c| - 1)^2],
             then r(s,a) = log c/(1-c), which estimates log d_E/d_U;
    (2) nu:  min  (1-gamma) E_0[nu(s)] + (1+alpha) log E_U[exp(A/(1+alpha))],
             where A(s,a,s') = r(s,a) + gamma nu(s') - nu(s);
    (3) pi:  max  E_U[exp(A/(1+alpha)) log pi(a|s)], behaviour cloning with those weights.

After its last decision a demonstration stays in an absorbing state, as in the authors' program.
Kim et al. evaluate the penalty at random mixtures of E and U; here it is evaluated on U, so that
nothing is drawn.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import logsigmoid

from filtering.vision.determinism import one_thread
from policies.data.moments import weighted_moments
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh, weighted_loss
from policies.learners.bc import BCConfig, clone, shape_for
from policies.learners.networks import DecisionNetwork, Encoder
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError


@dataclass(frozen=True)
class DemoDICEConfig(BCConfig):
    """Settings of DemoDICE; those of `BCConfig` are for its policy, problem (3)."""

    experts: tuple[int, ...] = ()
    """E: places in the pool of demonstrations that are known to be good."""
    alpha: float = 0.05
    """Weight of the divergence from U relative to that from E, 0 or more."""
    gamma: float = 0.99
    """Discount per decision, in (0, 1)."""
    gradient_penalty: float = 0.1
    """Weight of the penalty on the gradient of c, 0 or more."""
    hidden: int = 64
    """Width of the two layers of c and nu; Kim et al. take 256 for a million decisions."""
    ratio_steps: int = 300
    """Gradient steps for c, and as many for nu, each on all decisions."""
    ratio_learning_rate: float = 3e-3
    """Step size of Adam for c and nu."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        super().__post_init__()
        if not 0 < self.gamma < 1:
            raise ConfigError(f"gamma is {self.gamma}; choose more than 0 and less than 1.")
        if min(self.alpha, self.gradient_penalty) < 0:
            raise ConfigError("demodice needs alpha >= 0 and gradient_penalty >= 0.")
        if min(self.hidden, self.ratio_steps) < 1 or self.ratio_learning_rate <= 0:
            raise ConfigError(
                "demodice needs hidden >= 1, ratio_steps >= 1 and ratio_learning_rate > 0."
            )


@dataclass(frozen=True)
class Chain:
    """n decisions and, as the last of m = n + 1 rows, the absorbing state."""

    states: Tensor
    """Features of the state; the last feature marks the absorbing state.  # (m, F + 1)"""
    actions: Tensor
    """Chosen sub-task, one-hot; 0 in the absorbing state.  # (m, T)"""
    following: NDArray[np.int64]
    """Row of the next state.  # (m,)"""
    first: Tensor
    """Share of each row in the first states of demonstrations, sum 1.  # (m,)"""
    expert: Tensor
    """d_E: share of each row in E, sum 1.  # (m,)"""
    union: Tensor
    """d_U: share of each row in U, sum 1.  # (m,)"""


class DemoDICE:
    """Behaviour cloning in which each decision is weighted by the estimate of d / d_U."""

    policy_: SubtaskPolicy
    history_: tuple[float, ...]
    decision_weights_: NDArray[np.float64]
    """Estimate of d / d_U for each decision of positive weight, up to a factor.  # (n,)"""

    def __init__(self, config: DemoDICEConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or DemoDICEConfig()

    def fit(self, samples: DecisionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, all are 0, or no expert is left.
        """
        config = self.config
        samples, shares = weigh(samples, weights)
        moments = weighted_moments(samples, shares)
        encoder = Encoder(shape_for(samples, bottleneck=0), torch.Generator())
        encoder.standardise(moments)
        with one_thread():
            chain = make_chain(encoder, samples, shares, config.experts)
            advantages = learn_advantages(chain, learn_rewards(chain, config), config)
        exponents = advantages[:-1] / (1 + config.alpha)
        self.decision_weights_ = np.exp(exponents - exponents.max())
        products = shares * self.decision_weights_
        network = DecisionNetwork(shape_for(samples, config.bottleneck), config.seed)
        network.standardise(moments)
        self.history_ = clone(network, samples, products / products.sum(), config)
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


def make_chain(
    encoder: Encoder,
    samples: DecisionSamples,
    shares: NDArray[np.float64],
    experts: tuple[int, ...],
) -> Chain:
    """Link the decisions of every demonstration in order.

    Raises:
        ConfigError: none of `experts` is among the demonstrations.
    """
    good = np.isin(samples.demos, experts)
    if not good.any():
        raise ConfigError(
            "demodice needs demonstrations that are known to be good and are not left out; "
            "name their episodes with --expert."
        )
    n = len(shares)
    following = np.full(n + 1, n)
    first = np.zeros(n + 1)
    for demo in np.unique(samples.demos):
        rows = np.flatnonzero(samples.demos == demo)
        first[rows[0]] = shares[rows[0]]
        for row, after in pairwise(rows):
            following[row] = after
    with torch.inference_mode():
        seen = encoder(
            torch.from_numpy(samples.maps[:, 0].copy()), torch.from_numpy(samples.low_dim.copy())
        ).numpy()
    states = np.zeros((n + 1, seen.shape[1] + 1))
    states[:n, :-1], states[n, -1] = seen, 1
    actions = np.zeros((n + 1, samples.n_actions))
    actions[np.arange(n), samples.labels] = 1
    ends = following[:n] == n
    return Chain(
        torch.from_numpy(states),
        torch.from_numpy(actions),
        following,
        torch.from_numpy(first / first.sum()),
        torch.from_numpy(_visits(shares * good, ends)),
        torch.from_numpy(_visits(shares, ends)),
    )


def learn_rewards(chain: Chain, config: DemoDICEConfig) -> Tensor:
    """Problem (1): r(s,a) of every row, (m,)."""
    pairs = torch.cat([chain.states, chain.actions], dim=1).requires_grad_()
    classifier = _network(pairs.shape[1], config.hidden, config.seed)

    def loss() -> Tensor:
        logits = classifier(pairs)[:, 0]
        told = weighted_loss(-logsigmoid(logits), chain.expert)
        told = told + weighted_loss(-logsigmoid(-logits), chain.union)
        (slopes,) = torch.autograd.grad(logits.sum(), pairs, create_graph=True)
        steepness = torch.sqrt(slopes.square().sum(dim=1) + 1e-12)
        return told + config.gradient_penalty * weighted_loss((steepness - 1) ** 2, chain.union)

    _descend(classifier, loss, config)
    return classifier(pairs)[:, 0].detach()


def learn_advantages(chain: Chain, rewards: Tensor, config: DemoDICEConfig) -> NDArray[np.float64]:
    """Problem (2): A(s,a,s') of every row, (m,)."""
    value = _network(chain.states.shape[1], config.hidden, config.seed)
    temperature = 1 + config.alpha

    def advantages(values: Tensor) -> Tensor:
        return rewards + config.gamma * values[chain.following] - values

    def loss() -> Tensor:
        values = value(chain.states)[:, 0]
        exponents = chain.union.log() + advantages(values) / temperature
        start = (1 - config.gamma) * weighted_loss(values, chain.first)
        return start + temperature * exponents.logsumexp(dim=0)

    _descend(value, loss, config)
    found: NDArray[np.float64] = advantages(value(chain.states)[:, 0]).detach().numpy()
    return found


def _visits(shares: NDArray[np.float64], ends: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Append the absorbing state, visited once per demonstration, to `shares` (n,); sum 1."""
    visits = np.append(shares, shares[ends].sum())
    return visits / visits.sum()


def _network(inputs: int, hidden: int, seed: int) -> nn.Sequential:
    """Two hidden layers and one output; the initial weights are drawn from `seed`."""
    random = torch.Generator().manual_seed(seed)
    sizes = (inputs, hidden, hidden, 1)
    layers: list[nn.Module] = []
    for width, following in pairwise(sizes):
        layer = nn.Linear(width, following, dtype=torch.float64)
        for parameter in layer.parameters():
            nn.init.uniform_(parameter, -(width**-0.5), width**-0.5, generator=random)
        layers += [layer, nn.ReLU()]
    return nn.Sequential(*layers[:-1])


def _descend(network: nn.Module, loss: Callable[[], Tensor], config: DemoDICEConfig) -> None:
    optimizer = torch.optim.Adam(network.parameters(), lr=config.ratio_learning_rate)
    for _ in range(config.ratio_steps):
        optimizer.zero_grad()
        loss().backward()
        optimizer.step()
