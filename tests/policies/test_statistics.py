"""Rates and intervals against published and hand-computed values."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.common.statistics import grouped_rate, rate, wilson_interval

# Newcombe (1998), table I, method 3 (score, no continuity correction), 95 %.
NEWCOMBE = [
    (81, 263, 0.2553, 0.3662),
    (15, 148, 0.0624, 0.1605),
    (0, 20, 0.0, 0.1611),
    (1, 29, 0.0061, 0.1718),
]


@pytest.mark.parametrize(("hits", "trials", "low", "high"), NEWCOMBE)
def test_wilson_interval_is_the_published_one(hits, trials, low, high):
    assert wilson_interval(hits, trials) == pytest.approx((low, high), abs=5e-5)


def test_no_trials_say_nothing():
    assert wilson_interval(0, 0) == (0.0, 1.0)
    assert math.isnan(rate(0, 0).value)
    assert str(rate(0, 0)) == "no trials"
    assert grouped_rate([]).trials == 0


@given(st.integers(1, 500).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_interval_holds_the_share_and_mirrors(trial):
    hits, trials = trial
    low, high = wilson_interval(hits, trials)
    assert 0 <= low <= hits / trials <= high <= 1
    mirrored = wilson_interval(trials - hits, trials)
    assert mirrored == pytest.approx((1 - high, 1 - low), abs=1e-12)


@pytest.mark.parametrize(("hits", "trials"), [(-1, 4), (5, 4), (1, 0)])
def test_a_share_above_one_is_refused(hits, trials):
    with pytest.raises(ValueError, match="is not a share"):
        wilson_interval(hits, trials)


def test_groups_that_agree_with_chance_keep_wilsons_interval():
    assert grouped_rate([(1, 2)] * 20) == rate(20, 40)


def test_groups_of_identical_trials_count_as_one_trial_each():
    grouped = grouped_rate([(10, 10), (0, 10)] * 50)
    single = rate(50, 100)
    assert grouped.value == single.value
    # The unbiased variance between groups has n - 1 below it, hence not quite equal.
    assert (grouped.low, grouped.high) == pytest.approx((single.low, single.high), abs=1e-3)


def test_one_group_is_one_trial():
    assert grouped_rate([(7, 7)]).low == pytest.approx(wilson_interval(1, 1)[0])
    assert grouped_rate([(7, 7)]).high == 1.0


def test_empty_groups_change_nothing():
    assert grouped_rate([(1, 2), (2, 2), (0, 0)]) == grouped_rate([(1, 2), (2, 2)])


def test_text_is_in_percent():
    assert str(rate(9, 10)) == "90.0 % (59.6-98.2)"
