"""Laws of the default score, and the kinds of mistakes it is there to find."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.judging.norm.mixture import find_populations
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.norm.steps import StepList, count_steps, steps_of_frames
from teasim.common.statistics import auroc

T = 7
USUAL = tuple(range(T))
MISTAKEN = {
    "omission": (0, 1, 2, 4, 5, 6),
    "order": (0, 1, 5, 2, 3, 4, 6),
    "two omissions": (0, 2, 4, 5, 6),
}
ORDERS = st.lists(st.permutations(USUAL), min_size=3, max_size=9)


def steps(order, length=10):
    return StepList(tuple(order), (length,) * len(order))


def counts(orders, length=10):
    return count_steps([steps(order, length) for order in orders], T)


@given(orders=ORDERS, seed=st.integers(0, 99))
@settings(max_examples=20, deadline=None)
def test_the_order_of_the_pool_does_not_matter(orders, seed):
    pool = [*orders, USUAL, USUAL, USUAL]
    shuffled = np.random.default_rng(seed).permutation(len(pool))
    there = score_steps(counts(pool)).losses
    here = score_steps(counts([pool[k] for k in shuffled])).losses
    assert here == pytest.approx(there[shuffled], abs=1e-6)


@given(orders=ORDERS)
@settings(max_examples=20, deadline=None)
def test_equal_demonstrations_have_equal_losses_and_trust_is_a_share(orders):
    pool = [*orders, *orders, USUAL, USUAL]
    found = score_steps(counts(pool))
    assert found.losses[: len(orders)] == pytest.approx(found.losses[len(orders) : -2])
    assert ((found.trust >= 0) & (found.trust <= 1)).all()
    assert (found.losses >= -1e-9).all()


@pytest.mark.parametrize("kind", MISTAKEN)
@pytest.mark.parametrize("k", [1, 2, 4])
def test_mistakes_are_ranked_above_everything_usual(kind, k):
    pool = [USUAL] * 10 + [MISTAKEN[kind]] * k
    losses = score_steps(counts(pool)).losses
    assert losses[:10] == pytest.approx(np.zeros(10), abs=1e-6)
    assert losses[10:].min() > 2.0
    assert auroc(losses, np.arange(len(pool)) >= 10) == 1.0


def test_head_count_decides_and_not_which_half_is_alike():
    rng = np.random.default_rng(0)
    varied = [(0, *(1 + rng.permutation(5)), 6) for _ in range(10)]  # everybody's own order
    lacking = [(0, 2, 4, 6)] * 6  # all alike, two steps short
    found = find_populations(counts(varied + lacking))
    assert found.norm[:10].min() > 0.9
    assert found.norm[10:].max() < 0.1
    assert found.lack > 1
    losses = score_steps(counts(varied + lacking)).losses
    assert losses[:10].max() < losses[10:].min()


def test_what_is_missing_and_what_is_out_of_place_are_named():
    pool = [USUAL] * 8 + [MISTAKEN["omission"], MISTAKEN["order"]]
    found = score_steps(counts(pool))
    assert found.omitted[8].argmax() == 3
    a, b = np.unravel_index(found.misplaced[9].argmax(), (T, T))
    assert b == 5
    assert a in (2, 3, 4)


@given(length=st.integers(1, 50))
@settings(max_examples=10, deadline=None)
def test_how_long_everything_takes_does_not_matter(length):
    pool = [USUAL] * 5 + [MISTAKEN["order"]]
    assert score_steps(counts(pool, length)).losses == pytest.approx(
        score_steps(counts(pool)).losses
    )


def test_a_short_spurious_segment_says_little():
    clean = [steps(USUAL)] * 8
    blip = StepList((0, 5, 1, 2, 3, 4, 5, 6), (10, 1, 10, 10, 10, 10, 30, 10))
    moved = StepList((0, 5, 1, 2, 3, 4, 6), (10,) * 7)
    losses = score_steps(count_steps([*clean, blip, moved], T)).losses
    assert losses[8] < 2.0 < losses[9]


def test_counts_are_what_they_say():
    found = count_steps([StepList((0, 1, 0), (1, 2, 3))], 2)
    assert found.occurs.tolist() == [[1.0, 1.0]]
    assert found.before[0] == pytest.approx(np.array([[0, 1 / 4], [3 / 4, 0]]))
    assert found.follows[0].tolist() == [[0, 1, 1], [1, 0, 0], [1, 0, 0]]


def test_a_step_list_that_makes_no_sense_is_refused():
    with pytest.raises(ValueError, match="differ in number"):
        StepList((0, 1), (3,))
    with pytest.raises(ValueError, match="has no frames"):
        StepList((0,), (0,))


def test_frames_become_runs_and_background_joins_what_is_around():
    found = steps_of_frames(np.array([-1, 2, 2, -1, 2, 0, 1, 1, -1]))
    assert found == StepList((2, 0, 1), (3, 1, 2))
    with pytest.raises(ValueError, match="every frame is background"):
        steps_of_frames(np.array([-1, -1]))


def test_of_three_groups_told_only_the_lowest_is_trusted():
    """Told two, those out of order are near enough to the norm beside two steps left out."""
    order, gross = (0, 2, 1, 3, 4, 5, 6), (0, 1, 2, 3, 4)
    pool = counts([USUAL] * 6 + [order] * 4 + [gross] * 2)
    two, three = (score_steps(pool, n_groups=number) for number in (2, 3))
    assert two.losses[6:10].max() < three.losses[6:10].min()
    assert three.trust[6:].max() < two.trust[6:10].min()
    np.testing.assert_array_equal(score_steps(pool).losses, two.losses)


def test_one_thread_or_two_make_no_difference():
    pool = counts([USUAL] * 7 + list(MISTAKEN.values()))
    found = []
    for limit in (1, 2):
        with threadpool_limits(limits=limit):
            found.append(score_steps(pool).losses)
    assert found[0] == pytest.approx(found[1], abs=1e-6)
