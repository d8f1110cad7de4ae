"""Reinforcement from a cloned policy and from nothing, and the verb that does it."""

import json
from pathlib import Path

import numpy as np
import pytest

from policies.checkpoint import load_policy
from policies.cli import train
from policies.data.demos import DemosConfig, load_decisions
from policies.data.samples import DecisionSamples, ObservationSpec
from policies.play.evaluation import evaluate
from policies.ppo import LimitEnds, PPOConfig, improve, untrained
from policies.settings import EVENTS_ENVIRONMENT, EnvironmentConfig, EvaluationConfig
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from teasim.constants import STATE_NAMES, SUBTASKS
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES
from tests.policies.fakes import FAKE_WORLD, FLAGS
from tests.policies.learning import make

FEW = {"decisions": 64, "kept": 0, "environments": 2, "horizon": 16, "batch": 16, "epochs": 2}
"""Settings with which training is a matter of a moment."""
QUICKLY = [word for name, value in FEW.items() for word in ("--set", f"{name}={value}")]


@pytest.fixture(scope="module")
def from_state(fake_pool):
    return load_decisions(fake_pool, DemosConfig(observe="state"))


@pytest.fixture(scope="module")
def cloned(from_state):
    return make("bc").fit(from_state, np.ones(7)).policy_


def in_fake(policy, **settings):
    config = PPOConfig(**(FEW | settings))
    return improve(policy, config, environment=FAKE_WORLD, reward_weights=None)


def parameters(policy):
    return {name: value.numpy() for name, value in policy.network.state_dict().items()}


def assert_equal(one, other):
    for name, value in parameters(one).items():
        np.testing.assert_array_equal(value, parameters(other)[name], err_msg=name)


def test_nothing_finds_all_sub_tasks_equally_probable(from_state):
    policy = untrained(from_state)
    seen = {"agent_pos": np.zeros(len(STATE_NAMES)), "environment_state": np.ones(len(FLAGS))}
    np.testing.assert_allclose(policy.probabilities(seen)[0], 1 / 7)
    assert (policy.spec, policy.action_names) == (from_state.spec, SUBTASKS)


@pytest.mark.slow
def test_from_nothing_it_learns_the_fake_station(from_state):
    settings = {"decisions": 24_000, "horizon": 64, "environments": 8, "batch": 128, "epochs": 5}
    policy, curve = in_fake(untrained(from_state), **settings, learning_rate=1e-2)
    assert curve[0].success < 0.5 < 0.9 < curve[-1].success
    scores = evaluate(policy, EvaluationConfig(episodes=5, environment=FAKE_WORLD))
    assert scores["deterministic"].success.value == 1


def test_the_same_seed_gives_the_same_bits(cloned):
    first, curve = in_fake(cloned)
    again, same = in_fake(cloned)
    assert_equal(first, again)
    assert curve == same
    other, _ = in_fake(cloned, seed=1)
    with pytest.raises(AssertionError):
        assert_equal(first, other)


@pytest.mark.slow
def test_processes_change_nothing():
    environment = EnvironmentConfig(EVENTS_ENVIRONMENT)
    spec = ObservationSpec((), 0, 0, STATE_NAMES, ENVIRONMENT_STATE_NAMES)
    zeros = np.zeros((7, 1, 0, 0, 1, 1), dtype=np.float16)
    seen = np.zeros((7, spec.low_dim), dtype=np.float32)
    start = untrained(
        DecisionSamples(zeros, seen, np.arange(7), np.zeros(7, dtype=np.int64), spec, SUBTASKS)
    )
    config = PPOConfig(**FEW)
    here, curve = improve(start, config, environment=environment)
    there, same = improve(start, config, environment=environment, workers=Workers(2))
    assert_equal(here, there)
    assert curve == same


def test_the_start_is_not_changed_and_what_is_kept_stays(cloned):
    before = {name: value.copy() for name, value in parameters(cloned).items()}
    policy, curve = in_fake(cloned, kept=64)
    for name, value in before.items():
        np.testing.assert_array_equal(parameters(cloned)[name], value)
        np.testing.assert_allclose(parameters(policy)[name], value, rtol=1e-6, atol=1e-7)
    assert [update.decisions for update in curve] == [32, 64]
    assert sum(update.episodes for update in curve) >= 4


def test_a_cut_episode_ends():
    """PPO would otherwise go on with the estimated value of a state that nothing follows."""

    class Cut:
        def step(self, _action):
            return "seen", 0.0, False, True, {"is_success": False}

    wrapper = LimitEnds.__new__(LimitEnds)
    wrapper.env = Cut()
    assert wrapper.step(0) == ("seen", 0.0, True, False, {"is_success": False})


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        (
            {"decisions": 0},
            "ppo needs decisions, environments, horizon, batch and epochs >= 1, and kept >= 0.",
        ),
        ({"gamma": 0.0}, "ppo needs 0 < gamma <= 1, learning_rate > 0 and entropy >= 0."),
    ],
)
def test_settings_that_cannot_train_are_refused(setting, sentence):
    with pytest.raises(ConfigError) as error:
        PPOConfig(**setting)
    assert str(error.value) == sentence


def test_settings_of_the_reward_that_the_environment_lacks_are_named(cloned):
    with pytest.raises(ConfigError, match="reward_weights"):
        improve(cloned, PPOConfig(**FEW), environment=FAKE_WORLD)


@pytest.fixture
def fake_events(monkeypatch):
    """The fake station instead of TeaMakingEvents-v0."""

    def learn(policy, config, *, workers):
        assert workers.count == 1
        return improve(policy, config, environment=FAKE_WORLD, reward_weights=None)

    monkeypatch.setattr("policies.reinforcement.improve", learn)


@pytest.fixture(scope="module")
def run(fake_pool, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "bc"
    pool = str(fake_pool.root)
    assert train([pool, "--observe", "state", "-o", str(folder), "--jobs", "1"]) == 0
    return folder


@pytest.mark.usefixtures("fake_events")
@pytest.mark.parametrize("start", [True, False])
def test_the_verb_trains_further_or_from_nothing(fake_pool, run, tmp_path, capsys, start):
    out = tmp_path / "improved"
    words = [str(fake_pool.root), "--learner", "ppo", "-o", str(out), *QUICKLY]
    words += ["--from", str(run)] if start else []
    assert train(words) == 0
    printed = capsys.readouterr().out.splitlines()[-1]
    origin = str(run) if start else "nothing"
    assert printed.startswith(f"ppo from {origin}, 64 decisions, goal reached in ")
    assert printed.endswith(f" s -> {out}")
    training = json.loads((out / "policy.json").read_text())["training"]
    assert training["from"] == (str(run) if start else None)
    assert training["settings"]["decisions"] == 64
    assert [point["decisions"] for point in training["history"]] == [32, 64]
    assert load_policy(out).spec == load_policy(run).spec


REFUSED = {
    "level": ("--level", "joint"),
    "observe": ("--observe", "pixels"),
    "camera": ("--camera", "left"),
    "weights": ("--weights", "w.csv"),
    "use": ("--use", "ignore"),
    "expert": ("--expert", "1"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_ppo_does_not_take_is_named(fake_pool, tmp_path, name):
    words = [str(fake_pool.root), "--learner", "ppo", "-o", str(tmp_path / "new"), *REFUSED[name]]
    with pytest.raises(ConfigError) as error:
        train(words)
    assert str(error.value) == (
        "The learner 'ppo' learns from the state at the level subtask, not from demonstrations; "
        f"leave out --{name}."
    )


def test_only_ppo_starts_from_a_policy(fake_pool, run, tmp_path):
    words = [str(fake_pool.root), "--from", str(run), "-o", str(tmp_path / "new")]
    with pytest.raises(ConfigError) as error:
        train(words)
    assert str(error.value) == "The learner 'bc' takes no --from; only ppo does."


def test_a_policy_that_sees_something_else_is_refused(fake_pool, tmp_path):
    pool, run = str(fake_pool.root), tmp_path / "run"
    train([pool, "--camera", "left", "-o", str(run), "--jobs", "1"])
    new = tmp_path / "new"
    with pytest.raises(ConfigError) as error:
        train([pool, "--learner", "ppo", "--from", str(run), "-o", str(new)])
    assert str(error.value) == (
        f"The policy '{run}' does not see what '{Path(pool)}' logs; "
        "give the pool that it was trained on, and train it with --observe state."
    )
    assert not new.exists()
