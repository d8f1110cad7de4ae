"""stable-baselines3 plays every policy, and goes on from a cloned one."""

import numpy as np
import pytest
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy

from policies.data.demos import DemosConfig, load_decisions
from policies.data.samples import ObservationSpec
from policies.sb3 import as_ppo, sb3_environment
from teasim.common.errors import ConfigError
from teasim.constants import STATE_NAMES
from tests.policies.fakes import FAKE_WORLD, FLAGS, SIZE
from tests.policies.learning import AT_SUBTASKS, make

STATE = ObservationSpec((), 0, 0, STATE_NAMES, FLAGS)


@pytest.fixture(scope="module")
def from_state(fake_pool):
    return load_decisions(fake_pool, DemosConfig(observe="state"))


@pytest.fixture(scope="module")
def cloned(from_state):
    return make("bc").fit(from_state, np.ones(7)).policy_


@pytest.mark.parametrize("name", AT_SUBTASKS)
def test_evaluate_policy_plays_every_policy(name, from_state):
    policy = make(name).fit(from_state, np.array([1.0] * 6 + [0])).policy_
    env = sb3_environment(FAKE_WORLD, STATE)
    rewards, lengths = evaluate_policy(policy, env, 2, return_episode_rewards=True)
    assert (rewards, lengths) == ([1.0, 1.0], [7, 7])


@pytest.mark.parametrize("name", ["bc", "bc-rnn"])
def test_several_environments_at_once_are_episodes_of_their_own(name, from_state):
    policy = make(name).fit(from_state, np.array([1.0] * 6 + [0])).policy_
    envs = make_vec_env(lambda: sb3_environment(FAKE_WORLD, STATE), n_envs=3)
    rewards, lengths = evaluate_policy(policy, envs, 5, return_episode_rewards=True)
    assert (rewards, lengths) == ([1.0] * 5, [7] * 5)


@pytest.mark.parametrize("cameras", [("left", "cup"), ("left",)])
def test_evaluate_policy_plays_a_policy_that_sees_pictures(cameras, fake_pool):
    decisions = load_decisions(fake_pool, DemosConfig(cameras=cameras))
    policy = make("bc").fit(decisions, np.array([1.0] * 6 + [0])).policy_
    env = sb3_environment(FAKE_WORLD, policy.spec)
    rewards, _ = evaluate_policy(policy, env, 1, return_episode_rewards=True)
    assert rewards == [1.0]


def observations(n):
    random = np.random.default_rng(0)
    return {
        "agent_pos": random.normal(0, 0.02, (n, len(STATE_NAMES))).astype(np.float32),
        "environment_state": random.random((n, len(FLAGS)), dtype=np.float32),
    }


def chances_of(model, seen):
    tensors, _ = model.policy.obs_to_tensor(seen)
    with torch.no_grad():
        return model.policy.get_distribution(tensors).distribution.probs.numpy()


def test_the_ppo_model_is_the_policy(cloned, tmp_path):
    seen = observations(200)
    expected, _ = cloned.probabilities(seen)
    model = as_ppo(cloned, sb3_environment(FAKE_WORLD, STATE))
    np.testing.assert_allclose(chances_of(model, seen), expected, atol=1e-6)
    model.save(tmp_path / "model")
    loaded = PPO.load(tmp_path / "model", device="cpu")
    np.testing.assert_allclose(chances_of(loaded, seen), expected, atol=1e-6)
    actions, _ = cloned.predict(seen, deterministic=True)
    np.testing.assert_array_equal(loaded.predict(seen, deterministic=True)[0], actions)
    assert len(set(actions.tolist())) > 1


def test_ppo_goes_on_from_there(cloned):
    env = sb3_environment(FAKE_WORLD, STATE)
    model = as_ppo(cloned, env, n_steps=32, batch_size=32, n_epochs=1, learning_rate=1e-4, seed=0)
    seen = observations(20)
    before = chances_of(model, seen)
    model.learn(32)
    after = chances_of(model, seen)
    assert 0 < np.abs(after - before).max() < 0.05
    scale = model.policy.features_extractor.scale.numpy()
    np.testing.assert_array_equal(scale, cloned.network.encoder.low_dim_scale.numpy())


@pytest.mark.parametrize("name", ["bc-rnn", "bcnd"])
def test_a_memory_or_an_ensemble_cannot_become_ppo(name, from_state):
    policy = make(name, steps=1).fit(from_state, np.ones(7)).policy_
    with pytest.raises(ConfigError) as error:
        as_ppo(policy, sb3_environment(FAKE_WORLD, STATE))
    assert str(error.value) == (
        "Only a policy that sees the state and is neither recurrent nor an ensemble can become "
        "a PPO model; train with --observe state and --learner bc, demodice or r-maxent."
    )


def test_a_policy_that_sees_pictures_cannot_become_ppo(decisions):
    policy = make("bc", steps=1).fit(decisions, np.ones(7)).policy_
    assert policy.spec.height == SIZE
    with pytest.raises(ConfigError, match="sees the state"):
        as_ppo(policy, sb3_environment(FAKE_WORLD, STATE))
