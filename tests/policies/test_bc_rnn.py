"""A memory tells apart what looks the same."""

import numpy as np
import pytest

from policies.data.samples import DecisionSamples, ObservationSpec
from policies.learners.bc_rnn import places
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
