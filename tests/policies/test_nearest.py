"""The nearest neighbour: which step it finds, what it follows, when it leaves."""

from dataclasses import replace

import numpy as np
import pytest

from policies.learners.store import EARLIER, LATER
from tests.policies.learning import make


def observe(low_dim):
    return {"agent_pos": low_dim[..., :2], "environment_state": low_dim[..., 2:]}


@pytest.fixture(scope="module")
def policy(motions):
    return make("nearest").fit(motions, np.array([1.0, 1, 1, 1, 2])).policy_


def follow(policy, seen, **options):
    """Targets for what is seen, one after the other."""
    targets, state = [], None
    for number, row in enumerate(seen):
        start = np.array([number == 0])
        target, state = policy.predict(observe(row), state, start, **options)
        targets.append(target)
    return np.stack(targets)


def test_who_is_where_a_demonstration_was_does_what_it_did(motions):
    policy = make("nearest").fit(motions, np.ones(5)).policy_
    for demo in range(5):
        rows = motions.demos == demo
        found = follow(policy, motions.low_dim[rows], deterministic=True)
        np.testing.assert_array_equal(found, motions.targets[rows])


def test_of_two_equally_near_the_heavier_is_followed(policy, motions):
    between = (motions.low_dim[0] + motions.low_dim[24]) / 2
    target, _ = policy.predict(observe(between), deterministic=True)
    assert target.tolist() in motions.targets[motions.demos == 4].tolist()


def test_sampled_decisions_follow_by_weight(motions):
    same = replace(motions, low_dim=np.tile(motions.low_dim[:6], (5, 1)))
    policy = make("nearest").fit(same, np.array([1.0, 1, 1, 1, 2])).policy_
    seen = observe(np.repeat(same.low_dim[:1], 3000, axis=0))
    policy.set_random_seed(3)
    targets, _ = policy.predict(seen)
    heavy = (targets == motions.targets[24]).all(axis=1).mean()
    assert heavy == pytest.approx(1 / 3, abs=0.03)


def test_while_nothing_moves_time_goes_on(motions):
    """The joints rest while a gripper closes; only counting tells the steps apart."""
    still = replace(motions, low_dim=np.zeros_like(motions.low_dim))
    policy = make("nearest").fit(still, np.array([1.0, 0, 0, 0, 0])).policy_
    found = follow(policy, still.low_dim[:6], deterministic=True)
    np.testing.assert_array_equal(found, still.targets[:6])


def test_who_fell_behind_gets_back_into_step(motions):
    policy = make("nearest", chunk=1).fit(motions, np.array([1.0, 0, 0, 0, 0])).policy_
    seen = motions.low_dim[[0, 1, 1, 1, 2, 3]]
    found = follow(policy, seen, deterministic=True)
    np.testing.assert_array_equal(found, motions.targets[[0, 1, 1, 1, 2, 3]])
    assert min(EARLIER, LATER) >= 1


def test_who_is_carried_to_another_demonstration_follows_it_after_the_chunk(motions):
    """Two that lie far apart: the first is begun, then what is seen is of the second."""
    far = motions.take(motions.demos < 2)
    low_dim = far.low_dim + np.repeat([[0.0], [50.0]], 6, axis=0).astype(np.float32)
    targets = (far.targets + 10 * far.demos[:, None]).astype(np.float32)
    apart = replace(far, low_dim=low_dim, targets=targets)
    policy = make("nearest", chunk=3).fit(apart, np.ones(2)).policy_
    seen = apart.low_dim[[0, 1, 8, 9, 10, 11]]
    found = follow(policy, seen, deterministic=True)
    np.testing.assert_array_equal(found, apart.targets[[0, 1, 2, 9, 10, 11]])


def test_after_the_end_the_last_target_is_held(motions):
    policy = make("nearest", chunk=4).fit(motions, np.array([1.0, 0, 0, 0, 0])).policy_
    found = follow(policy, motions.low_dim[[4, 5, 5, 5, 5]], deterministic=True)
    np.testing.assert_array_equal(found, motions.targets[[4, 5, 5, 5, 5]])


def test_a_batch_is_a_loop_and_an_episode_that_starts_forgets(policy, motions):
    rows = motions.low_dim[[0, 7]]
    policy.set_random_seed(1)
    both, state = policy.predict(observe(rows))
    policy.set_random_seed(1)
    loop = [policy.predict(observe(row))[0] for row in rows]
    np.testing.assert_array_equal(both, loop)
    again, after = policy.predict(observe(rows), state, np.array([True, False]), deterministic=True)
    fresh, _ = policy.predict(observe(rows), deterministic=True)
    np.testing.assert_array_equal(again[0], fresh[0])
    assert after[0][1, 0] == state[0][1, 0] + 1


def test_the_history_says_how_alike_the_demonstrations_are(motions):
    alone = make("nearest").fit(motions, np.array([1.0, 0, 0, 0, 0])).history_
    pair = motions.take(motions.demos < 2)
    targets = np.tile(pair.targets[:6], (2, 1))
    targets[6:] += 0.5
    both = replace(pair, low_dim=np.tile(pair.low_dim[:6], (2, 1)), targets=targets)
    assert alone == (0.0,)
    assert make("nearest").fit(both, np.ones(2)).history_ == (pytest.approx(0.5),)
