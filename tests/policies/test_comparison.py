"""Differences that are known, counted by hand, or not there."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest

from policies.play.comparison import compare, comparison_json, comparison_text
from policies.play.evaluation import evaluate
from policies.settings import EvaluationConfig
from teasim.common.errors import ConfigError
from teasim.common.statistics import bootstrap_difference, mcnemar
from tests.policies.fakes import FAKE_WORLD, ScriptedPolicy

STUCK = (0, 4, 4, 4, 4, 4, 4)


@given(st.integers(0, 60), st.integers(0, 60))
def test_mcnemar_is_the_binomial_test_of_the_discordant_pairs(one, two):
    expected = binomtest(one, one + two).pvalue if one + two else 1.0
    assert mcnemar(one, two) == pytest.approx(expected)


def test_mcnemar_by_hand():
    assert mcnemar(6, 0) == pytest.approx(2 / 64)
    assert mcnemar(5, 1) == pytest.approx(14 / 64)


def test_equal_policies_differ_by_nothing():
    groups = [(3, 7), (7, 7), (0, 14)]
    found = bootstrap_difference(groups, groups)
    assert (found.value, found.low, found.high) == (0, 0, 0)


def test_the_difference_is_that_of_the_shares_and_its_interval_covers():
    """Pairs with a known mean difference: the interval holds it in about 95 of 100 sets."""
    random = np.random.default_rng(1)
    held = 0
    for seed in range(100):
        first = [(int(h), 10) for h in random.binomial(10, 0.7, 40)]
        second = [(int(h), 10) for h in random.binomial(10, 0.5, 40)]
        found = bootstrap_difference(first, second, seed)
        assert found.value == pytest.approx(
            sum(h for h, _ in first) / 400 - sum(h for h, _ in second) / 400
        )
        held += found.low <= 0.2 <= found.high
    assert 88 <= held <= 99


def test_swapping_the_policies_turns_the_sign():
    first, second = [(3, 7), (7, 7), (2, 9)], [(1, 7), (5, 7), (6, 9)]
    one, two = bootstrap_difference(first, second), bootstrap_difference(second, first)
    assert (one.value, one.low, one.high) == pytest.approx((-two.value, -two.high, -two.low))


def test_what_makes_no_pairs_is_refused():
    with pytest.raises(ValueError, match="2 and 1 groups make no pairs"):
        bootstrap_difference([(1, 1), (1, 1)], [(1, 1)])
    with pytest.raises(ValueError, match="0 and 0 groups"):
        bootstrap_difference([], [])


@pytest.fixture(scope="module")
def found():
    config = EvaluationConfig(6, environment=FAKE_WORLD)
    return evaluate(ScriptedPolicy(), config), evaluate(ScriptedPolicy(STUCK), config)


def test_two_policies_on_the_same_episodes(found):
    deterministic, sampled = compare(*found)
    assert (deterministic.mode, sampled.mode) == ("deterministic", "sampled")
    assert (deterministic.success.first, deterministic.success.second) == (6, 0)
    stove = deterministic.violations["stove left on"]
    assert deterministic.success.p_value == pytest.approx(2 / 64)
    assert (stove.first, stove.second) == (0, 6)
    # All of 7 actions against 2 of 14, in every episode alike.
    assert deterministic.policy_accuracy.value == pytest.approx(1 - 2 / 14)
    assert deterministic.policy_accuracy.low == pytest.approx(1 - 2 / 14)


def test_the_comparison_in_words_and_json(found):
    comparisons = compare(*found)
    lines = comparison_text(comparisons[:1], "old").splitlines()
    assert lines[:4] == [
        "deterministic decisions, against old on the same 6 episodes",
        "  policy accuracy  +85.7 points (+85.7 to +85.7)",
        "  goal reached     with this one only in 6 episodes, with the other only in 0, p = 0.031",
        "  stove left on    with this one only in 0 episodes, with the other only in 6, p = 0.031",
    ]
    assert lines[4].startswith("  spilled          with this one only in 0 episodes,")
    assert comparison_json(comparisons)["sampled"]["success"]["first"] == 6


def test_other_seeds_are_refused(found):
    moved = {
        mode: replace(s, episodes=tuple(replace(e, seed=e.seed + 1) for e in s.episodes))
        for mode, s in found[1].items()
    }
    with pytest.raises(ConfigError) as error:
        compare(found[0], moved)
    assert str(error.value) == "Two policies can only be compared on the same seeds."
