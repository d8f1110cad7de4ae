"""Proximal policy optimisation (Schulman et al., arXiv 1707.06347) of a cloned policy, or of none.

It learns in `teasim/TeaMakingEvents-v0`, where a million decisions take minutes, and is scored in
physics like every other policy. The policy is the log-linear one of behaviour cloning, so it is
saved and loaded as such, and "from nothing" is that policy with all sub-tasks equally probable. The
value network starts untrained; until it has been fitted to the policy, the policy is kept, or
meaningless advantages would destroy what was cloned.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any

import gymnasium as gym
import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv

from filtering.vision.determinism import one_thread
from policies.data.moments import weighted_moments
from policies.data.samples import DecisionSamples
from policies.data.weighting import weigh
from policies.learners.bc import shape_for
from policies.learners.networks import DecisionNetwork
from policies.learners.subtask_policy import SubtaskPolicy
from policies.sb3 import as_policy, as_ppo, sb3_environment
from policies.settings import EVENTS_ENVIRONMENT, EnvironmentConfig
from teasim.common.errors import ConfigError
from teasim.common.workers import IN_PROCESS, Workers

SHAPED = MappingProxyType({"subtasks": 1.0, "reference": 1.0, "idle": 1.0, "violations": 1.0})
"""Weights of the terms of the reward besides the goal, see `teasim.envs.decisions`. All are 1: the
terms are sevenths already, so an episode as in Seq_1 earns 3, a third of it with the goal."""


@dataclass(frozen=True)
class PPOConfig:
    """Settings of proximal policy optimisation; defaults are SB3's unless a reason is given."""

    decisions: int = 100_000
    """Decisions in all environments together."""
    kept: int = 10_000
    """Decisions at the beginning during which only the value network learns."""
    environments: int = 16
    """Environments that are played at once."""
    horizon: int = 128
    """Decisions in each environment between two updates; an episode has 14 at most."""
    batch: int = 256
    """Decisions per gradient step."""
    epochs: int = 10
    """Passes over the decisions of an update."""
    learning_rate: float = 1e-3
    """First step size of Adam, which falls linearly to 0; SB3's 3e-4 is meant for deep networks,
    and this policy is log-linear."""
    gamma: float = 0.99
    """Discount per decision, in (0, 1]."""
    entropy: float = 0.0
    """Weight of the policy's entropy [1/nat]."""
    seed: int = 0
    """Seed of the scenes, the decisions and the value network."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a value that cannot train."""
        counts = (self.decisions, self.environments, self.horizon, self.batch, self.epochs)
        if min(counts) < 1 or self.kept < 0:
            raise ConfigError(
                "ppo needs decisions, environments, horizon, batch and epochs >= 1, and kept >= 0."
            )
        if not 0 < self.gamma <= 1 or self.learning_rate <= 0 or self.entropy < 0:
            raise ConfigError("ppo needs 0 < gamma <= 1, learning_rate > 0 and entropy >= 0.")


@dataclass(frozen=True)
class Update:
    """A point of a learning curve: the episodes that ended before an update of the policy."""

    decisions: int
    """Decisions since the beginning."""
    episodes: int
    """Episodes that ended since the last point."""
    reward: float | None
    """Their mean sum of rewards; None without episodes."""
    success: float | None
    """Share of them that reached the goal; None without episodes."""


class LimitEnds(gym.Wrapper[Any, Any, Any, Any]):
    """An episode that is cut counts as one that ended: nothing is worth anything afterwards.

    Otherwise PPO continues a cut episode with the estimated value of its last state. That estimate
    has nothing to hold on to where a policy turns the oven on and off until the limit, so it drifts
    upwards and the policy learns never to finish.
    """

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Carry out `action`."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        return observation, reward, terminated or truncated, False, info


class Curve(BaseCallback):
    """Collects an `Update` before every update."""

    def __init__(self) -> None:
        """Start without episodes."""
        super().__init__()
        self.updates: list[Update] = []
        """The learning curve."""
        self._ended: list[tuple[float, bool]] = []

    def _on_step(self) -> bool:
        for info in self.locals["infos"]:
            if "episode" in info:
                self._ended.append((info["episode"]["r"], bool(info["is_success"])))
        return True

    def _on_rollout_end(self) -> None:
        means = np.mean(self._ended, axis=0).tolist() if self._ended else (None, None)
        self.updates.append(Update(self.num_timesteps, len(self._ended), *means))
        self._ended.clear()


def untrained(samples: DecisionSamples, seed: int = 0) -> SubtaskPolicy:
    """Return the policy to which all sub-tasks are equally probable.

    `samples` say what it sees and on what scale; their decisions are not used.
    """
    samples, shares = weigh(samples, np.ones(int(samples.demos.max()) + 1))
    network = DecisionNetwork(shape_for(samples, bottleneck=0), seed)
    network.standardise(weighted_moments(samples, shares))
    return SubtaskPolicy(network, samples.spec, samples.action_names)


def improve(
    policy: SubtaskPolicy,
    config: PPOConfig,
    *,
    environment: EnvironmentConfig | None = None,
    reward_weights: Mapping[str, float] | None = SHAPED,
    workers: Workers = IN_PROCESS,
) -> tuple[SubtaskPolicy, tuple[Update, ...]]:
    """Train `policy` further by reinforcement; return the new policy and its learning curve.

    Args:
        policy: Where to begin; it is not changed.
        config: Settings.
        environment: Where to learn; by default in TeaMakingEvents-v0.
        reward_weights: Weights of terms of the reward; None leaves them to the environment.
        workers: With more than one, every environment has a process of its own. The result is the
            same; it is faster if the environment simulates physics.

    Raises:
        ConfigError: `policy` sees pictures, has a memory or is an ensemble, or the environment
            cannot be made.
    """
    environment = environment or EnvironmentConfig(EVENTS_ENVIRONMENT)
    weights = {} if reward_weights is None else {"reward_weights": dict(reward_weights)}
    make = partial(sb3_environment, environment, policy.spec, **weights)
    envs = vector_environment(make, config.environments, workers)
    curve = Curve()
    with one_thread():
        try:
            model = as_ppo(policy, envs, **_arguments(config))
            _learn(model, config, curve)
        finally:
            envs.close()
    return as_policy(model, policy), tuple(curve.updates)


def vector_environment(
    make: Callable[[], gym.Env[Any, Any]], count: int, workers: Workers = IN_PROCESS
) -> VecEnv:
    """Play `count` environments at once: in this process, or with several workers in one each.

    Raises:
        ConfigError: there is no such environment, or it does not take the settings.
    """
    make().close()  # a wrong setting is reported here, not by a worker that dies

    def ending() -> gym.Env[Any, Any]:
        return LimitEnds(make())

    if workers.count > 1:
        return SubprocVecEnv([ending] * count, start_method="spawn")
    return DummyVecEnv([ending] * count)


def _arguments(config: PPOConfig) -> dict[str, Any]:
    return {
        "n_steps": config.horizon,
        "batch_size": min(config.batch, config.horizon * config.environments),
        "n_epochs": config.epochs,
        "learning_rate": lambda left: left * config.learning_rate,
        "gamma": config.gamma,
        "ent_coef": config.entropy,
        "seed": config.seed,
    }


def _learn(model: PPO, config: PPOConfig, curve: Curve) -> None:
    kept = min(config.kept, config.decisions)
    if kept:
        model.policy.action_net.requires_grad_(False)
        model.learn(kept, callback=curve)
        model.policy.action_net.requires_grad_(True)
    rest = config.decisions - model.num_timesteps
    if rest > 0:
        model.learn(rest, callback=curve, reset_num_timesteps=False)
