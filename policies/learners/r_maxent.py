"""Robust maximum-entropy behaviour cloning: demonstration weights are learned with the policy.

Hussein, Crowe, Petrik & Begum (arXiv 2101.01251), and equation 3 of the paper:

    min over lambda, w of (1/M) sum_d w_d l_d(lambda)    s.t.    sum_d w_d = M,  0 <= w_d <= 1

where l_d is demonstration d's mean of -log p_lambda(t|s), p_lambda(t|s) is proportional to
exp(lambda_t . f(s)), and M is half of the demonstrations. The problem has no finite solution if the
sub-tasks of the trusted half are separable, and its weights are 0 or 1. So a ridge on lambda is
added (feature expectations are matched up to a slack), and an entropy of w at temperature tau,

    (1/M) sum_d [w_d l_d(lambda) + tau (w_d log w_d + (1-w_d) log(1-w_d))] + ridge/2 |lambda|^2 ,

and tau is lowered step by step. Both half-steps are exact: the problem in lambda is convex, and
w_d = sigmoid((nu - l_d) / tau) with nu from sum_d w_d = M. A demonstration of given weight a counts
as a copies of it.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_softmax

from filtering.vision.determinism import one_thread
from policies.data.moments import weighted_moments
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh
from policies.learners.bc import shape_for
from policies.learners.networks import DecisionNetwork
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.common.errors import ConfigError
from teasim.common.trimming import soft_trim


@dataclass(frozen=True)
class RMaxEntConfig:
    """Settings of robust maximum-entropy behaviour cloning."""

    trusted: float = 0.5
    """M, as a share of all demonstrations, more than 0 and less than 1."""
    ridge: float = 1e-2
    """Strength of the ridge on lambda [nat]."""
    hottest: float = 1.0
    """First temperature [nat]; weights are nearly equal."""
    coldest: float = 0.01
    """Last temperature [nat]; weights are nearly 0 or 1."""
    steps: int = 24
    """Number of temperatures from the first to the last, in geometric progression."""
    seed: int = 0
    """Has no effect: the problem starts at equal weights and nothing is drawn."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value out of range."""
        if not 0 < self.trusted < 1:
            raise ConfigError(f"trusted is {self.trusted}; choose more than 0 and less than 1.")
        if self.ridge <= 0 or self.steps < 1:
            raise ConfigError("r-maxent needs ridge > 0 and steps >= 1.")
        if not 0 < self.coldest <= self.hottest:
            raise ConfigError("r-maxent needs 0 < coldest <= hottest.")


@dataclass(frozen=True)
class Problem:
    """n decisions of D demonstrations, as equation 3 takes them."""

    features: NDArray[np.float64]
    """f(s).  # (n, F)"""
    labels: NDArray[np.int64]
    """Chosen sub-task t.  # (n,)"""
    demos: NDArray[np.int64]
    """Demonstration of each decision, numbered 0, 1, ...  # (n,)"""
    copies: NDArray[np.float64]
    """Number of times each demonstration counts.  # (D,)"""
    actions: int
    """T, number of sub-tasks."""


@dataclass(frozen=True)
class Solution:
    """Solution of a problem."""

    multipliers: NDArray[np.float64]
    """lambda.  # (F, T)"""
    weights: NDArray[np.float64]
    """w.  # (D,)"""
    history: tuple[float, ...]
    """Weighted mean of the losses before the first and after each temperature [nat]."""


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
            solution = solve(_problem(network, samples, weights), self.config)
        multipliers = torch.from_numpy(solution.multipliers.T.copy())
        network.head.weight.data.copy_(multipliers[:, :-1])
        network.head.bias.data.copy_(multipliers[:, -1])
        self.history_ = solution.history
        self.demo_weights_ = solution.weights
        self.policy_ = SubtaskPolicy(network, samples.spec, samples.action_names)
        return self


def solve(problem: Problem, config: RMaxEntConfig) -> Solution:
    """Solve for lambda and w in alternation while the temperature falls."""
    trusted = config.trusted * problem.copies.sum()
    weights = np.full(len(problem.copies), config.trusted)
    multipliers = np.zeros((problem.features.shape[1], problem.actions))
    history = [float(np.log(problem.actions))]
    for temperature in np.geomspace(config.hottest, config.coldest, config.steps):
        multipliers = fit_multipliers(problem, weights / trusted, multipliers, config.ridge)
        losses = demo_losses(problem, multipliers)
        weights = soft_trim(losses, problem.copies, trusted, temperature)
        history.append(float(problem.copies * weights @ losses / trusted))
    return Solution(multipliers, weights, tuple(history))


def demo_losses(problem: Problem, multipliers: NDArray[np.float64]) -> NDArray[np.float64]:
    """l_d(lambda) of every demonstration [nat], (D,)."""
    surprise = -log_softmax(problem.features @ multipliers, axis=1)
    chosen = surprise[np.arange(len(problem.labels)), problem.labels]
    means: NDArray[np.float64] = np.bincount(problem.demos, chosen) / np.bincount(problem.demos)
    return means


def fit_multipliers(
    problem: Problem, weights: NDArray[np.float64], start: NDArray[np.float64], ridge: float
) -> NDArray[np.float64]:
    """Minimise sum_d copies_d weights_d l_d(lambda) + ridge/2 |lambda|^2 over lambda, (F, T)."""
    each = (problem.copies * weights / np.bincount(problem.demos))[problem.demos]
    chosen = np.eye(problem.actions)[problem.labels]

    def objective(flat: NDArray[np.float64]) -> tuple[float, NDArray[np.float64]]:
        multipliers = flat.reshape(start.shape)
        logs = log_softmax(problem.features @ multipliers, axis=1)
        value = -each @ (logs * chosen).sum(axis=1) + ridge / 2 * flat @ flat
        # The gradient is the gap between the model's feature expectations and the demonstrations'.
        gap = problem.features.T @ (each[:, None] * (np.exp(logs) - chosen))
        return float(value), (gap + ridge * multipliers).ravel()

    options = {"maxiter": 5000, "maxfun": 10000, "ftol": 0.0, "gtol": 1e-12}
    found = minimize(objective, start.ravel(), jac=True, method="L-BFGS-B", options=options)
    multipliers: NDArray[np.float64] = found.x.reshape(start.shape)
    return multipliers


def _problem(
    network: DecisionNetwork, samples: DecisionSamples, weights: NDArray[np.float64]
) -> Problem:
    """Encode every view of every decision and append a constant feature."""
    low_dim = torch.from_numpy(samples.low_dim.copy())
    n_views = samples.maps.shape[1]
    with torch.inference_mode():
        views = [
            network.encoder(torch.from_numpy(samples.maps[:, view].copy()), low_dim).numpy()
            for view in range(n_views)
        ]
    features = np.concatenate(views)
    present, demos = np.unique(samples.demos, return_inverse=True)
    return Problem(
        np.hstack([features, np.ones((len(features), 1))]),
        np.tile(samples.labels, n_views),
        np.tile(demos, n_views),
        weights[present],
        samples.n_actions,
    )
