"""Policies among those of stable-baselines3: played by its tools, and trained further with PPO.

Every policy answers `predict` as SB3 asks, so `evaluate_policy` takes it as it is, in an
environment of `sb3_environment`. A policy without memory that sees the state can become a PPO model
that does the same, and then learn from its own attempts:

    from policies.checkpoint import load_policy
    from policies.play.rollout import EnvironmentConfig
    from policies.sb3 import as_ppo, sb3_environment

    policy = load_policy(Path("policy"))          # teasim train POOL --observe state -o policy
    env = sb3_environment(EnvironmentConfig(), policy.spec)
    model = as_ppo(policy, env, n_steps=64, batch_size=64, learning_rate=1e-4)
    model.learn(2000)                             # actions, each a whole sub-task in physics
    model.save("finetuned")

The value network starts untrained: keep the learning rate low, or the first updates, made with
advantages that mean nothing, undo what was cloned.
"""

from typing import Any

import gymnasium as gym
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor

from policies.data.samples import STATE_KEYS, ObservationSpec
from policies.learners.networks import DecisionNetwork
from policies.learners.subtask_policy import SubtaskPolicy
from policies.play.rollout import EnvironmentConfig, make_environment
from teasim.common.errors import ConfigError


class FlatPictures(gym.ObservationWrapper[Any, Any, Any]):
    """The picture of every camera under a key of its own: SB3 takes no dict within a dict."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        """Wrap an environment whose `pixels` is a dict of pictures."""
        super().__init__(env)
        spaces = dict(env.observation_space.spaces)  # type: ignore[attr-defined]
        self.observation_space = gym.spaces.Dict(self._flat(spaces, spaces["pixels"].spaces))

    def observation(self, observation: dict[str, Any]) -> dict[str, Any]:
        """Return the observation with `pixels` taken apart."""
        return self._flat(observation, observation["pixels"])

    def _flat(self, parts: dict[str, Any], pictures: dict[str, Any]) -> dict[str, Any]:
        rest = {key: part for key, part in parts.items() if key != "pixels"}
        return rest | {f"pixels_{camera}": picture for camera, picture in pictures.items()}


class StandardisedState(BaseFeaturesExtractor):
    """The state as a cloned policy sees it: its parts in a row, each number to its scale."""

    mean: Tensor
    scale: Tensor

    def __init__(self, observation_space: gym.spaces.Dict) -> None:
        """Begin with mean 0 and scale 1."""
        length = gym.spaces.flatdim(observation_space)
        super().__init__(observation_space, length)
        self.register_buffer("mean", torch.zeros(length, dtype=torch.float64))
        self.register_buffer("scale", torch.ones(length, dtype=torch.float64))

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Return the standardised state (n, S) float32 of observations (n, ...)."""
        state = torch.cat([observations[key] for key in STATE_KEYS], dim=1)
        # In double precision, as when it was cloned: a scale may be small beside its mean.
        return ((state.double() - self.mean) / self.scale).float()


def sb3_environment(config: EnvironmentConfig, spec: ObservationSpec) -> gym.Env[Any, Any]:
    """Make the environment a policy of `spec` needs, in the form SB3 takes, with its `Monitor`.

    Raises:
        ConfigError: there is no such environment, or it does not take the settings.
    """
    env = make_environment(config, spec)
    return Monitor(FlatPictures(env) if len(spec.cameras) > 1 else env)


def as_ppo(policy: SubtaskPolicy, env: gym.Env[Any, Any], **settings: Any) -> PPO:
    """Return a PPO model that decides as `policy` does; `settings` are those of `PPO`.

    Args:
        policy: a policy without memory that sees the state (`--observe state`), of learner bc,
            demodice or r-maxent.
        env: where it will be played and trained further, see `sb3_environment`.
        settings: for example `n_steps`, `batch_size`, `learning_rate`, `seed`.

    Raises:
        ConfigError: `policy` sees pictures, or its network is not that of such a learner.
    """
    network = policy.network
    if policy.spec.cameras or not isinstance(network, DecisionNetwork):
        raise ConfigError(
            "Only a policy that sees the state and has neither memory nor members can become a PPO "
            "model; train with --observe state and --learner bc, demodice or r-maxent."
        )
    architecture = {
        "features_extractor_class": StandardisedState,
        "net_arch": {"pi": [], "vf": [64, 64]},
    }
    model = PPO("MultiInputPolicy", env, policy_kwargs=architecture, device="cpu", **settings)
    encoder = network.encoder
    model.policy.action_net.load_state_dict(network.head.state_dict())
    with torch.no_grad():
        extractor = model.policy.features_extractor
        assert isinstance(extractor, StandardisedState)
        extractor.mean.copy_(encoder.low_dim_mean)
        extractor.scale.copy_(encoder.low_dim_scale)
    return model
