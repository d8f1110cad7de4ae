"""Policies in stable-baselines3: evaluated with its tools, and converted to and from PPO models.

Every policy has SB3's `predict`, so `evaluate_policy` accepts it unchanged, in an environment of
`sb3_environment`. A policy that sees the state and is not recurrent can be converted into a PPO
model with the same probabilities, and back; `policies.ppo` trains it in between.
"""

from typing import Any

import gymnasium as gym
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv
from torch import Tensor

from policies.data.samples import STATE_KEYS, ObservationSpec
from policies.learners.networks import DecisionNetwork
from policies.learners.subtask_policy import SubtaskPolicy
from policies.play.environments import make_environment
from policies.settings import EnvironmentConfig
from teasim.common.errors import ConfigError


class FlatPictures(gym.ObservationWrapper[Any, Any, Any]):
    """Gives the picture of every camera a key of its own: SB3 accepts no nested dict spaces."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        """Wrap an environment whose `pixels` is a dict of pictures."""
        super().__init__(env)
        spaces = dict(env.observation_space.spaces)  # type: ignore[attr-defined]
        self.observation_space = gym.spaces.Dict(self._flat(spaces, spaces["pixels"].spaces))

    def observation(self, observation: dict[str, Any]) -> dict[str, Any]:
        """Return the observation with one key per camera."""
        return self._flat(observation, observation["pixels"])

    def _flat(self, parts: dict[str, Any], pictures: dict[str, Any]) -> dict[str, Any]:
        rest = {key: part for key, part in parts.items() if key != "pixels"}
        return rest | {f"pixels_{camera}": picture for camera, picture in pictures.items()}


class StandardisedState(BaseFeaturesExtractor):
    """The state as a cloned policy sees it: concatenated and standardised."""

    mean: Tensor
    scale: Tensor

    def __init__(self, observation_space: gym.spaces.Dict) -> None:
        """Start with mean 0 and scale 1."""
        length = gym.spaces.flatdim(observation_space)
        super().__init__(observation_space, length)
        self.register_buffer("mean", torch.zeros(length, dtype=torch.float64))
        self.register_buffer("scale", torch.ones(length, dtype=torch.float64))

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Return the standardised state (n, S) float32 of observations (n, ...)."""
        state = torch.cat([observations[key] for key in STATE_KEYS], dim=1)
        # In double precision, as during cloning: a scale may be much smaller than its mean.
        return ((state.double() - self.mean) / self.scale).float()


def sb3_environment(
    config: EnvironmentConfig, spec: ObservationSpec, **settings: Any
) -> gym.Env[Any, Any]:
    """Make the environment for a policy of `spec` in a form that SB3 accepts, in a `Monitor`.

    Further `settings` are passed on to the environment.

    Raises:
        ConfigError: there is no such environment, or it does not take the settings.
    """
    env = make_environment(config, spec, **settings)
    return Monitor(FlatPictures(env) if len(spec.cameras) > 1 else env)


def as_ppo(policy: SubtaskPolicy, env: gym.Env[Any, Any] | VecEnv, **settings: Any) -> PPO:
    """Return a PPO model with the action probabilities of `policy`.

    Args:
        policy: a policy that sees the state (`--observe state`), of learner bc, demodice or
            r-maxent.
        env: environment for training, see `sb3_environment`.
        settings: arguments of `PPO`, e.g. `n_steps`, `batch_size`, `learning_rate`, `seed`.

    Raises:
        ConfigError: `policy` sees pictures, or its network is not that of such a learner.
    """
    network = policy.network
    if policy.spec.cameras or not isinstance(network, DecisionNetwork):
        raise ConfigError(
            "Only a policy that sees the state and is neither recurrent nor an ensemble can become "
            "a PPO model; train with --observe state and --learner bc, demodice or r-maxent."
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


def as_policy(model: PPO, like: SubtaskPolicy) -> SubtaskPolicy:
    """Return the policy of `model`, which `as_ppo` made of `like` and which was trained since."""
    assert isinstance(like.network, DecisionNetwork)
    network = DecisionNetwork(like.network.shape, seed=0)
    network.encoder.load_state_dict(like.network.encoder.state_dict())
    network.head.load_state_dict(model.policy.action_net.state_dict())
    return SubtaskPolicy(network, like.spec, like.action_names)
