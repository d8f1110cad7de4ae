"""The score `combined`: whom the norm may accuse."""

import numpy as np

from filtering.judging.combined import MAJORITY, SUSPECT, unless_alone
from filtering.judging.judgement import Judgement
from filtering.judging.thresholds import Grouping

NAMES = ("kept", "out of order", "steps left out")


def by_norm(groups):
    """A verdict of the norm by the groups of the demonstrations."""
    groups = np.array(groups)
    weights = np.where(groups > 0, 0.1, 0.9)
    grouping = Grouping(groups, 0.5, NAMES)
    return Judgement(-np.log(weights), weights, grouping, weights, ((),) * len(groups))


def test_a_verdict_of_the_norm_alone_is_not_heard():
    heard = unless_alone(by_norm([0, 1, 2]), np.zeros(3), np.ones(3))
    assert heard.grouping.groups.tolist() == [0, 0, 0]
    assert heard.weights.tolist() == [1.0, 1.0, 1.0]
    assert heard.losses.tolist() == [0.0, 0.0, 0.0]


def test_moments_that_find_it_unusual_are_a_witness():
    strengths = np.array([SUSPECT, SUSPECT, SUSPECT - 0.01])
    heard = unless_alone(by_norm([1, 2, 2]), strengths, np.ones(3))
    assert heard.grouping.groups.tolist() == [1, 2, 0]
    assert heard.weights.tolist() == [0.1, 0.1, 1.0]


def test_the_order_of_a_minority_is_a_witness_of_a_wrong_order_alone():
    kept = np.array([MAJORITY - 0.01, MAJORITY, MAJORITY - 0.01])
    heard = unless_alone(by_norm([1, 1, 2]), np.zeros(3), kept)
    assert heard.grouping.groups.tolist() == [1, 0, 0]
