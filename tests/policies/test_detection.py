"""Scores of a filter over pools."""

import math

import numpy as np
import pytest

from policies.experiments.detection import Judged, detection_scores, told_how_many


def pool(flagged, *, wrong=(0, 0, 0, 1), first=0, probabilities=None):
    names = tuple(f"demo{first + number}" for number in range(len(wrong)))
    losses = tuple(map(float, flagged))
    return Judged(names, tuple(map(bool, wrong)), tuple(map(bool, flagged)), losses, probabilities)


def test_the_four_counts_and_what_is_made_of_them():
    scores = detection_scores([pool((0, 0, 0, 1)), pool((1, 0, 0, 0), first=4)])
    assert (scores.true_positives, scores.false_positives) == (1, 1)
    assert (scores.false_negatives, scores.true_negatives) == (1, 5)
    assert (scores.accuracy.hits, scores.accuracy.trials) == (6, 8)
    assert scores.recall.value == scores.precision.value == scores.f1 == 0.5
    assert scores.false_alarms.value == pytest.approx(1 / 6)
    assert scores.auroc == pytest.approx((1 + 1 / 3) / 2)


def test_a_perfect_filter():
    scores = detection_scores([pool((0, 0, 0, 1), probabilities=(0.0, 0.0, 0.0, 1.0))])
    assert (scores.f1, scores.auroc, scores.brier) == (1, 1, 0)


def test_what_cannot_be_told_is_not_a_number():
    scores = detection_scores([pool((0, 0, 0), wrong=(0, 0, 0))])
    assert math.isnan(scores.auroc)
    assert math.isnan(scores.brier)
    assert math.isnan(scores.f1)
    assert scores.recall.trials == 0


def test_the_same_demonstrations_again_say_little_more():
    once = detection_scores([pool((1, 0, 0, 1))]).false_alarms
    again = detection_scores([pool((1, 0, 0, 1))] * 20).false_alarms
    fresh = detection_scores([pool((1, 0, 0, 1), first=4 * n) for n in range(20)]).false_alarms
    assert again.value == fresh.value == once.value
    assert again.high - again.low > 2 * (fresh.high - fresh.low)


def test_baselines_flag_as_many_as_there_are():
    assert told_how_many(np.array([1.0, 3.0, 2.0, 3.0]), 2).tolist() == [False, True, False, True]
    assert not told_how_many(np.zeros(3), 0).any()
