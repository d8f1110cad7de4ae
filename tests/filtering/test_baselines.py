"""Every baseline is a score like any other: finite, and blind to the order of the pool."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.judging.baselines import (
    BASELINES,
    bernoulli,
    bigram,
    edit_distance,
    length,
    segments,
)
from filtering.judging.norm.steps import StepList

STEP_LISTS = st.lists(st.tuples(st.integers(0, 4), st.integers(1, 9)), min_size=1, max_size=6).map(
    lambda pairs: StepList(tuple(a for a, _ in pairs), tuple(n for _, n in pairs))
)
FULL = StepList((0, 1, 2, 3), (5, 5, 5, 5))
SHORT = StepList((0, 2, 3), (5, 5, 5))
SWAPPED = StepList((0, 2, 1, 3), (5, 5, 5, 5))


@pytest.mark.parametrize("name", BASELINES)
@given(pool=st.lists(STEP_LISTS, min_size=3, max_size=8), seed=st.integers(0, 9))
@settings(max_examples=10, deadline=None)
def test_losses_are_finite_and_permute_with_the_pool(
    name: str, pool: list[StepList], seed: int
) -> None:
    losses = BASELINES[name](pool)
    assert losses.shape == (len(pool),)
    assert np.isfinite(losses).all()
    if name == "random":
        return
    order = np.random.default_rng(seed).permutation(len(pool))
    permuted = BASELINES[name]([pool[k] for k in order])
    assert permuted == pytest.approx(losses[order], abs=1e-6)


@pytest.mark.parametrize("name", [name for name in BASELINES if name != "random"])
def test_an_omission_stands_out(name: str) -> None:
    losses = BASELINES[name]([FULL] * 8 + [SHORT])
    assert losses[8] > losses[:8].max()


@pytest.mark.parametrize("name", ["bigram", "bernoulli", "edit"])
def test_another_order_stands_out_where_order_is_looked_at(name: str) -> None:
    losses = BASELINES[name]([FULL] * 8 + [SWAPPED])
    assert losses[8] > losses[:8].max()


def test_values_are_what_they_say() -> None:
    pool = [FULL, FULL, SHORT]
    assert length(pool).tolist() == [-20, -20, -15]
    assert segments(pool).tolist() == [-4, -4, -3]
    assert edit_distance(pool) == pytest.approx([0, 0, 1 / 4])
    # START-0 and 3-END: 2 others of 2 and 5 labels; 0-2: none, 2-3: two.
    usual, never = np.log(4.5 / 2.5), np.log(4.5 / 0.5)
    assert bigram(pool)[2] == pytest.approx((3 * usual + never) / 4)
    # 0, 2, 3 and three bigrams as both others; 1, 0-1, 1-2 unlike both, 0-2 unlike both.
    assert bernoulli(pool)[2] == pytest.approx(-6 * np.log(2.5 / 3) - 4 * np.log(0.5 / 3))
