"""Chunks, styles and the memory of a joint-level policy."""

from dataclasses import replace

import numpy as np
import pytest

from policies.bc_chunk import Motions
from tests.policies.learning import make, replay

MOTIONS = Motions(
    np.arange(7, dtype=np.float32)[:, None],
    10 * np.arange(7, dtype=np.float32)[:, None],
    np.array([3, 7]),
    np.array([0.25, 0.75]),
)


def observe(low_dim):
    return {"agent_pos": low_dim[..., :2], "environment_state": low_dim[..., 2:]}


@pytest.fixture(scope="module")
def policy(motions):
    return make("bc-chunk", steps=400).fit(motions, np.array([1.0, 1, 1, 1, 2])).policy_


def test_a_chunk_goes_on_to_the_end_and_holds_the_last_target():
    chunks = MOTIONS.chunks(np.array([1, 6, 3]), np.array([0, 1, 1]), 3)[..., 0]
    np.testing.assert_array_equal(chunks, [[10, 20, 20], [60, 60, 60], [30, 40, 50]])


def test_steps_are_drawn_by_weight_from_their_demonstration():
    rows, demos = MOTIONS.draw(np.random.default_rng(0), 4000)
    assert (np.searchsorted(MOTIONS.stops, rows, side="right") == demos).all()
    assert demos.mean() == pytest.approx(0.75, abs=0.03)
    found = np.bincount(rows, minlength=7) / 4000
    np.testing.assert_allclose(found, [0.25 / 3] * 3 + [0.75 / 4] * 4, atol=0.02)


def test_the_typical_style_is_that_of_the_heaviest_demonstration(policy, motions):
    chances = policy.network.chances.numpy()
    np.testing.assert_allclose(sorted(chances), [1 / 6] * 4 + [1 / 3], rtol=1e-6)
    assert chances[policy.typical] == chances.max()
    # The heaviest one goes the other way round, and deterministic decisions with it.
    target, _ = policy.predict(observe(motions.low_dim[24]), deterministic=True)
    missed = np.abs(target - motions.targets[[0, 24]]).max(axis=1)
    assert missed[1] < 0.2 < missed[0]


def test_of_equal_weights_the_best_learned_is_typical(motions):
    policy = make("bc-chunk").fit(motions, np.ones(5)).policy_
    assert policy.typical == policy.network.errors.argmin()


def test_sampled_styles_are_drawn_by_weight_and_kept_for_the_episode(policy, motions):
    seen = observe(np.repeat(motions.low_dim[:1], 3000, axis=0))
    policy.set_random_seed(3)
    _, state = policy.predict(seen)
    drawn = np.bincount(state[0][:, 0].astype(int), minlength=5) / 3000
    np.testing.assert_allclose(drawn, policy.network.chances, atol=0.03)
    _, after = policy.predict(seen, state, np.zeros(3000, dtype=bool))
    np.testing.assert_array_equal(after[0][:, 0], state[0][:, 0])


def test_a_target_is_the_mean_of_all_that_was_said_about_it(policy, motions):
    first, state = policy.predict(observe(motions.low_dim[0]), deterministic=True)
    second, _ = policy.predict(
        observe(motions.low_dim[1]), state, np.zeros(1, dtype=bool), deterministic=True
    )
    silent = (state[0], np.zeros_like(state[1]), np.zeros_like(state[2]))
    alone, told = policy.predict(
        observe(motions.low_dim[1]), silent, np.zeros(1, dtype=bool), deterministic=True
    )
    said_before = state[1][0, 0]  # by the first chunk about the second step
    np.testing.assert_allclose(second, (said_before + alone) / 2, rtol=1e-6)
    assert state[1].shape == (1, 3, 2)
    assert not told[1][0, -1].any()
    assert first.shape == (2,)


def test_a_batch_is_a_loop_and_an_episode_that_starts_forgets(policy, motions):
    rows = motions.low_dim[[0, 7]]
    policy.set_random_seed(1)
    both, state = policy.predict(observe(rows))
    policy.set_random_seed(1)
    loop = [policy.predict(observe(row))[0] for row in rows]
    np.testing.assert_allclose(both, loop, rtol=1e-6)
    again, _ = policy.predict(observe(rows), state, np.array([True, False]), deterministic=True)
    fresh, _ = policy.predict(observe(rows), deterministic=True)
    np.testing.assert_allclose(again[0], fresh[0], rtol=1e-6)
    assert np.abs(again[1] - fresh[1]).max() > 1e-3


def test_where_nothing_moves_the_time_decides(motions):
    """The joints rest while a gripper would close: only the time tells the steps apart."""
    still = replace(motions, low_dim=np.zeros_like(motions.low_dim))
    same = replace(still, targets=np.tile(motions.targets[:6], (5, 1)))
    policy = make("bc-chunk", steps=300).fit(same, np.ones(5)).policy_
    found = replay(policy, same)
    assert np.abs(found - same.targets).max() < 0.3
    assert np.ptp(found[:6], axis=0).min() > 1


def test_what_the_demonstrations_differ_in_is_their_style(motions):
    """Two that part ways at the same place: each style goes its own way, none the mean."""
    low_dim = np.tile(np.zeros((6, 3), dtype=np.float32), (2, 1))
    targets = np.repeat([[1.0, 1.0], [-1.0, -1.0]], 6, axis=0).astype(np.float32)
    forked = replace(motions, low_dim=low_dim, targets=targets, demos=np.repeat([0, 1], 6))
    policy = make("bc-chunk", steps=300, noise=0.0).fit(forked, np.ones(2)).policy_
    policy.set_random_seed(0)
    ways = np.stack([policy.predict(observe(low_dim[0]))[0] for _ in range(20)])
    assert (np.abs(np.abs(ways) - 1) < 0.1).all()
    assert set(np.sign(ways[:, 0])) == {-1, 1}
