"""DemoDICE (Kim et al., ICLR 2022): imitation from a few expert and many supplementary demos.

The demonstrations E are known to be good; U is the union of all demonstrations. The method seeks a
policy whose stationary distribution d is close to that of E without leaving that of U,

    max over d of  - KL(d || d_E) - alpha KL(d || d_U) .

Three problems are solved one after the other:

    (1) c:   min  - E_E[log c(s,a)] - E_U[log(1 - c(s,a))] + penalty E[(|grad log c/(1-c)| - 1)^2],
             then r(s,a) = log c/(1-c), which estimates log d_E/d_U;
    (2) nu:  min  (1-gamma) E_0[nu(s)] + (1+alpha) log E_U[exp(A/(1+alpha))]
                  + nu_penalty E[|grad nu|^2],  where A(s,a,s') = r(s,a) + gamma nu(s') - nu(s);
    (3) pi:  max  E_U[exp(A/(1+alpha)) log pi(a|s)], behaviour cloning with those weights.

The penalties and the absorbing state after the last decision are those of the authors' program
(github.com/geon-hyeong/imitation-dice): the gradient of c is taken at random mixtures of rows of E
and U and of U and U, that of nu at U and at mixtures of states of E and U and of the next ones.

The penalty on nu decides whether anything is learned from a few demonstrations with continuous
states. No state occurs twice then, so the demonstrations are separate chains, and on a chain the
flow that (2) asks for, d(s') = gamma d(s), leaves no choice: a nu that is free at every state
cancels r, A is the same for all demonstrations, and (3) is behaviour cloning. The penalty makes
states that are near each other share their nu, and r decides between what was done there.
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
from policies.data.weighting import distinct, weigh, weighted_loss
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
    nu_penalty: float = 1e-2
    """Weight of the penalty on the gradient of nu, 0 or more. Kim et al. take 1e-4 for a million
    decisions; 1e-2 was the best of 0, 1e-4, 1e-3, 1e-2, 1e-1, 1 and 10 on one pool of 18
    demonstrations."""
    mixtures: int = 256
    """Mixtures of either kind that are drawn per gradient step for the penalties."""
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
        if min(self.alpha, self.gradient_penalty, self.nu_penalty) < 0:
            raise ConfigError(
                "demodice needs alpha >= 0, gradient_penalty >= 0 and nu_penalty >= 0."
            )
        counts = (self.hidden, self.mixtures, self.ratio_steps)
        if min(counts) < 1 or self.ratio_learning_rate <= 0:
            raise ConfigError(
                "demodice needs hidden >= 1, mixtures >= 1, ratio_steps >= 1 and "
                "ratio_learning_rate > 0."
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
    """Estimate of d / d_U for each of `samples_`, up to a factor.  # (n,)"""
    samples_: DecisionSamples
    """The decisions of positive weight; equal demonstrations are merged."""

    def __init__(self, config: DemoDICEConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or DemoDICEConfig()

    def fit(self, samples: DecisionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, all are 0, or no expert is left.
        """
        config = self.config
        samples, shares, good = distinct(*weigh(samples, weights), config.experts)
        moments = weighted_moments(samples, shares)
        encoder = Encoder(shape_for(samples, bottleneck=0), torch.Generator())
        encoder.standardise(moments)
        with one_thread():
            chain = make_chain(encoder, samples, shares, good)
            advantages = learn_advantages(chain, learn_rewards(chain, config), config)
        exponents = advantages[:-1] / (1 + config.alpha)
        self.decision_weights_ = np.exp(exponents - exponents.max())
        self.samples_ = samples
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
    good: NDArray[np.bool_],
) -> Chain:
    """Link the decisions of every demonstration in order; `good` (n,) marks those of E.

    Raises:
        ConfigError: no demonstration is in E.
    """
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
    pairs = torch.cat([chain.states, chain.actions], dim=1)
    classifier = _network(pairs.shape[1], config.hidden, config.seed)
    random = torch.Generator().manual_seed(config.seed)

    def loss() -> Tensor:
        logits = classifier(pairs)[:, 0]
        told = weighted_loss(-logsigmoid(logits), chain.expert)
        told = told + weighted_loss(-logsigmoid(-logits), chain.union)
        drawn = Mixtures.draw(chain, config.mixtures, random)
        mixed = torch.cat([drawn.of_both(pairs), drawn.of_union(pairs)])
        steepness = torch.sqrt(_slopes(classifier, mixed) + 1e-12)
        return told + config.gradient_penalty * ((steepness - 1) ** 2).mean()

    _descend(classifier, loss, config)
    return classifier(pairs)[:, 0].detach()


def learn_advantages(chain: Chain, rewards: Tensor, config: DemoDICEConfig) -> NDArray[np.float64]:
    """Problem (2): A(s,a,s') of every row, (m,)."""
    value = _network(chain.states.shape[1], config.hidden, config.seed)
    random = torch.Generator().manual_seed(config.seed)
    temperature = 1 + config.alpha
    after = chain.states[chain.following]

    def advantages(values: Tensor) -> Tensor:
        return rewards + config.gamma * values[chain.following] - values

    def loss() -> Tensor:
        values = value(chain.states)[:, 0]
        exponents = chain.union.log() + advantages(values) / temperature
        start = (1 - config.gamma) * weighted_loss(values, chain.first)
        drawn = Mixtures.draw(chain, config.mixtures, random)
        places = torch.cat(
            [chain.states[drawn.union], drawn.of_both(chain.states), drawn.of_both(after)]
        )
        smooth = config.nu_penalty * _slopes(value, places).mean()
        return start + temperature * exponents.logsumexp(dim=0) + smooth

    _descend(value, loss, config)
    found: NDArray[np.float64] = advantages(value(chain.states)[:, 0]).detach().numpy()
    return found


@dataclass(frozen=True)
class Mixtures:
    """Rows drawn from E and from U, and how much of each goes into a mixture."""

    expert: Tensor
    """Rows of E.  # (b,)"""
    union: Tensor
    """Rows of U.  # (b,)"""
    other: Tensor
    """Other rows of U.  # (b,)"""
    share: Tensor
    """Share of the first row in a mixture.  # (b, 1)"""

    @classmethod
    def draw(cls, chain: Chain, count: int, random: torch.Generator) -> Self:
        """Draw the rows of `count` mixtures of either kind."""

        def rows(shares: Tensor) -> Tensor:
            return torch.multinomial(shares, count, replacement=True, generator=random)

        share = torch.rand(count, 1, generator=random, dtype=torch.float64)
        return cls(rows(chain.expert), rows(chain.union), rows(chain.union), share)

    def of_both(self, values: Tensor) -> Tensor:
        """Mixtures of E and U of `values` (m, ...), (b, ...)."""
        return self.share * values[self.expert] + (1 - self.share) * values[self.union]

    def of_union(self, values: Tensor) -> Tensor:
        """Mixtures of U and U of `values` (m, ...), (b, ...)."""
        return self.share * values[self.other] + (1 - self.share) * values[self.union]


def _slopes(network: nn.Module, places: Tensor) -> Tensor:
    """Squared norm of the gradient of `network` at `places` (b, F), (b,)."""
    places = places.detach().requires_grad_()
    (slopes,) = torch.autograd.grad(network(places).sum(), places, create_graph=True)
    return slopes.square().sum(dim=1)


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
