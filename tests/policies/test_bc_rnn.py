"""A memory tells apart what looks the same."""

import numpy as np
import pytest

from policies.checkpoint import load_policy, save_policy
from policies.data.samples import DecisionSamples, ObservationSpec
from policies.learners.bc_rnn import places, windows
from teasim.common.errors import ConfigError
from tests.policies.learning import make, replay

SPEC = ObservationSpec((), 0, 0, ("hint",), ("noise",))


@pytest.fixture(scope="module")
def recall():
    """Twelve demonstrations of three decisions: the first shows a hint, the last depends on it."""
    hints = np.arange(12) % 2
    low_dim = np.zeros((12, 3, 2), dtype=np.float32)
    low_dim[:, 0, 0] = 2.0 * hints - 1
    labels = np.stack([np.zeros(12), np.zeros(12), 1 + hints], axis=1).astype(np.int64)
    maps = np.zeros((36, 1, 0, 0, 1, 1), dtype=np.float16)
    demos = np.repeat(np.arange(12), 3)
    return DecisionSamples(
        maps, low_dim.reshape(36, 2), labels.ravel(), demos, SPEC, ("wait", "left", "right")
    )


def test_what_was_seen_before_decides(recall):
    remembering = make("bc-rnn").fit(recall, np.ones(12)).policy_
    assert (replay(remembering, recall).argmax(axis=1) == recall.labels).all()
    forgetting = make("bc").fit(recall, np.ones(12)).policy_
    last = replay(forgetting, recall)[2::3]
    np.testing.assert_allclose(last[:, 1], last[:, 2], atol=1e-6)


def test_an_episode_played_step_by_step_is_the_episode_learned(recall):
    learner = make("bc-rnn", steps=30).fit(recall, np.ones(12))
    chosen = replay(learner.policy_, recall)[np.arange(36), recall.labels]
    after = make("bc-rnn", steps=31).fit(recall, np.ones(12))
    # The history has the loss before every step: the 31st is that of 30 steps' parameters.
    assert -np.log(chosen).mean() == pytest.approx(after.history_[-1], rel=1e-9)


def observe(recall, demos, step):
    rows = [3 * demo + step for demo in demos]
    low_dim = recall.low_dim[rows]
    return {"agent_pos": low_dim[:, :1], "environment_state": low_dim[:, 1:]}


def test_the_memory_restarts_where_an_episode_does(recall):
    policy = make("bc-rnn").fit(recall, np.ones(12)).policy_
    start, going = np.array([True, True]), np.array([False, False])
    _, memory = policy.predict(observe(recall, [0, 1], 0), None, start, deterministic=True)
    _, memory = policy.predict(observe(recall, [0, 1], 1), memory, going, deterministic=True)
    assert [part.shape for part in memory] == [(2, 64), (2, 64)]
    # The second episode begins anew, as if nothing had been seen.
    half, _ = policy.probabilities(observe(recall, [0, 0], 0), memory, np.array([False, True]))
    fresh, _ = policy.probabilities(observe(recall, [0, 0], 0))
    np.testing.assert_allclose(half[1], fresh[1], rtol=1e-12)
    assert np.abs(half[0] - fresh[0]).max() > 1e-3


def test_places_of_decisions_in_their_demonstrations():
    found = places(np.array([4, 4, 7, 4, 7, 9]))
    assert found.tolist() == [[0, 0], [0, 1], [1, 0], [0, 2], [1, 1], [2, 0]]


def test_windows_are_all_runs_of_the_horizon():
    rows, found = windows(places(np.array([4, 4, 7, 4, 7, 4])), 3)
    assert rows.tolist() == [0, 1, 3, 1, 3, 5, 2, 4]
    assert found.tolist() == [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2], [2, 0], [2, 1]]


@pytest.mark.parametrize("layers", [1, 2])
def test_a_horizon_that_covers_the_episode_changes_nothing(recall, layers):
    settings = {"layers": layers, "steps": 40}
    whole = make("bc-rnn", **settings).fit(recall, np.ones(12)).policy_
    same = make("bc-rnn", horizon=3, **settings).fit(recall, np.ones(12)).policy_
    np.testing.assert_allclose(replay(same, recall), replay(whole, recall), rtol=1e-9)


def test_what_lies_beyond_the_horizon_is_forgotten(recall):
    """The hint is shown two decisions before it is needed."""
    forgetting = make("bc-rnn", horizon=2).fit(recall, np.ones(12)).policy_
    last = replay(forgetting, recall)[2::3]
    np.testing.assert_allclose(last[::2], last[1::2], atol=1e-9)


def test_with_a_horizon_each_decision_counts_once(recall):
    """The share of a decision is divided among its windows, so the first loss is that of no one."""
    learner = make("bc-rnn", horizon=2, steps=1).fit(recall, np.ones(12))
    assert learner.history_[0] == pytest.approx(np.log(3))


def test_two_layers_and_a_horizon_are_saved(recall, tmp_path):
    published = {"hidden": 400, "layers": 2, "horizon": 10, "steps": 1}
    policy = make("bc-rnn", **published).fit(recall, np.ones(12)).policy_
    save_policy(policy, tmp_path, training={})
    again = load_policy(tmp_path)
    assert again.network.settings == {"hidden": 400, "layers": 2, "horizon": 10}
    np.testing.assert_array_equal(replay(again, recall), replay(policy, recall))


def test_a_network_of_one_layer_that_was_saved_before_is_read(recall):
    network = make("bc-rnn", steps=1).fit(recall, np.ones(12)).policy_.network
    before = type(network)(network.shape, 0, hidden=64)
    before.load_state_dict(network.state_dict())


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [
        ({"hidden": 0}, "bc-rnn needs hidden >= 1 and layers >= 1."),
        ({"layers": 0}, "bc-rnn needs hidden >= 1 and layers >= 1."),
        ({"horizon": 0}, "horizon is 0; choose 1 or more, or none."),
    ],
)
def test_a_memory_of_no_size_is_refused(setting, sentence):
    with pytest.raises(ConfigError) as error:
        make("bc-rnn", **setting)
    assert str(error.value) == sentence
