"""Robust maximum-entropy behaviour cloning: whom to trust is learned together with the policy.

Hussein, Crowe, Petrik & Begum (arXiv 2101.01251), and equation 3 of the paper:

    min over lambda, w of (1/M) sum_d w_d l_d(lambda)    s.t.    sum_d w_d = M,  0 <= w_d <= 1

where l_d is demonstration d's mean of -log p_lambda(t|s), p_lambda(t|s) is proportional to
exp(lambda_t . f(s)), and M is half of the demonstrations. As it stands the problem has no finite
solution wherever the trusted half can be told apart, and weights that are 0 or 1. So lambda gets a
ridge (feature expectations are matched up to a slack), and w an entropy of temperature tau,

    (1/M) sum_d [w_d l_d(lambda) + tau (w_d log w_d + (1-w_d) log(1-w_d))] + ridge/2 |lambda|^2 ,

which is cooled down. Both half-steps are exact: lambda is a convex problem, and
w_d = sigmoid((nu - l_d) / tau) with nu from sum_d w_d = M. A demonstration that is given the weight
a counts as a copies of it.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize
from scipy.special import expit, log_softmax

from filtering.vision.determinism import one_thread
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh, weighted_moments
from policies.learners.bc import shape_for
from policies.learners.networks import DecisionNetwork
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError

REACH = 50.0
"""Temperatures from the outermost loss at which a demonstration surely is in or out."""


@dataclass(frozen=True)
class RMaxEntConfig:
    """Settings of robust maximum-entropy behaviour cloning."""

    trusted: float = 0.5
    """M, as a share of all demonstrations."""
    ridge: float = 1e-2
    """Strength of the ridge on lambda [nat]."""
    hottest: float = 1.0
    """Temperature the weights start at [nat]; nearly equal weights."""
    coldest: float = 0.01
    """Temperature they end at [nat]; nearly 0 or 1."""
    steps: int = 24
    """Temperatures from one to the other, a constant factor apart."""
    seed: int = 0
    """Changes nothing: the problem starts at equal weights and nothing is drawn."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that poses no problem."""
        if not 0 < self.trusted < 1:
            raise ConfigError(f"trusted is {self.trusted}; choose more than 0 and less than 1.")
        if self.ridge <= 0 or self.steps < 1:
            raise ConfigError("r-maxent needs ridge > 0 and steps >= 1.")
        if not 0 < self.coldest <= self.hottest:
            raise ConfigError("r-maxent needs 0 < coldest <= hottest.")


@dataclass(frozen=True)
class Rows:
    """What is known about n decisions of D demonstrations."""

    features: NDArray[np.float64]
    """f(s).  # (n, F)"""
    labels: NDArray[np.int64]
    """Chosen sub-task t.  # (n,)"""
    demos: NDArray[np.int64]
    """Demonstration of each, from 0 and none left out.  # (n,)"""
    copies: NDArray[np.float64]
    """How many times each demonstration counts.  # (D,)"""
    actions: int
    """T, sub-tasks to choose from."""


@dataclass(frozen=True)
class Solution:
    """What solves the problem."""

    multipliers: NDArray[np.float64]
    """lambda.  # (F, T)"""
    weights: NDArray[np.float64]
    """w.  # (D,)"""
    history: tuple[float, ...]
    """Weighted mean of the losses at the start and after each temperature [nat]."""


class RMaxEnt:
    """Equation 3; f(s) is the strongest activation of each channel, the state, and a constant."""

    policy_: SubtaskPolicy
    history_: tuple[float, ...]
    demo_weights_: NDArray[np.float64]
    """w of every demonstration of positive given weight, in the order of the pool.  # (D,)"""

    def __init__(self, config: RMaxEntConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or RMaxEntConfig()

    def fit(self, samples: DecisionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        samples, shares = weigh(samples, weights)
        network = DecisionNetwork(shape_for(samples, bottleneck=0), self.config.seed)
        network.standardise(weighted_moments(samples, shares))
        with one_thread():
            solution = solve(_rows(network, samples, weights), self.config)
        multipliers = torch.from_numpy(solution.multipliers.T.copy())
        network.head.weight.data.copy_(multipliers[:, :-1])
        network.head.bias.data.copy_(multipliers[:, -1])
        self.history_ = solution.history
        self.demo_weights_ = solution.weights
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


def solve(rows: Rows, config: RMaxEntConfig) -> Solution:
    """Find lambda and w by turns while the temperature falls."""
    trusted = config.trusted * rows.copies.sum()
    weights = np.full(len(rows.copies), config.trusted)
    multipliers = np.zeros((rows.features.shape[1], rows.actions))
    history = [float(np.log(rows.actions))]
    for temperature in np.geomspace(config.hottest, config.coldest, config.steps):
        multipliers = fit_multipliers(rows, weights / trusted, multipliers, config.ridge)
        losses = demo_losses(rows, multipliers)
        weights = trust(losses, rows.copies, trusted, temperature)
        history.append(float(rows.copies * weights @ losses / trusted))
    return Solution(multipliers, weights, tuple(history))


def demo_losses(rows: Rows, multipliers: NDArray[np.float64]) -> NDArray[np.float64]:
    """l_d(lambda) of every demonstration [nat], (D,)."""
    surprise = -log_softmax(rows.features @ multipliers, axis=1)
    chosen = surprise[np.arange(len(rows.labels)), rows.labels]
    means: NDArray[np.float64] = np.bincount(rows.demos, chosen) / np.bincount(rows.demos)
    return means


def trust(
    losses: NDArray[np.float64], copies: NDArray[np.float64], trusted: float, temperature: float
) -> NDArray[np.float64]:
    """w_d = sigmoid((nu - l_d) / tau), (D,), with nu such that sum_d copies_d w_d = `trusted`."""

    def surplus(level: float) -> float:
        return float(copies @ expit((level - losses) / temperature) - trusted)

    margin = REACH * temperature
    level = brentq(surplus, losses.min() - margin, losses.max() + margin, xtol=1e-14)
    weights: NDArray[np.float64] = expit((level - losses) / temperature)
    return weights


def fit_multipliers(
    rows: Rows, weights: NDArray[np.float64], start: NDArray[np.float64], ridge: float
) -> NDArray[np.float64]:
    """Minimise sum_d copies_d weights_d l_d(lambda) + ridge/2 |lambda|^2 over lambda, (F, T)."""
    each = (rows.copies * weights / np.bincount(rows.demos))[rows.demos]
    chosen = np.eye(rows.actions)[rows.labels]

    def objective(flat: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        multipliers = flat.reshape(start.shape)
        logs = log_softmax(rows.features @ multipliers, axis=1)
        value = -each @ (logs * chosen).sum(axis=1) + ridge / 2 * flat @ flat
        # The gradient is the gap between the model's feature expectations and the demonstrations'.
        gap = rows.features.T @ (each[:, None] * (np.exp(logs) - chosen))
        return float(value), (gap + ridge * multipliers).ravel()

    options = {"maxiter": 5000, "maxfun": 10000, "ftol": 0.0, "gtol": 1e-12}
    found = minimize(objective, start.ravel(), jac=True, method="L-BFGS-B", options=options)
    multipliers: NDArray[np.float64] = found.x.reshape(start.shape)
    return multipliers


def _rows(network: DecisionNetwork, samples: DecisionSamples, weights: NDArray[np.float64]) -> Rows:
    """Every view of every decision, as the network sees it, with a constant feature at the end."""
    low_dim = torch.from_numpy(samples.low_dim.copy())
    n_views = samples.maps.shape[1]
    with torch.inference_mode():
        views = [
            network.encoder(torch.from_numpy(samples.maps[:, view].copy()), low_dim).numpy()
            for view in range(n_views)
        ]
    features = np.concatenate(views)
    present, demos = np.unique(samples.demos, return_inverse=True)
    return Rows(
        np.hstack([features, np.ones((len(features), 1))]),
        np.tile(samples.labels, n_views),
        np.tile(demos, n_views),
        weights[present],
        samples.n_actions,
    )
