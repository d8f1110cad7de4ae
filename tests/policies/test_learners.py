"""Laws that every learner keeps."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from policies.learners.registry import LEARNERS, find_learner
from teasim.common.errors import ConfigError
from tests.policies.learning import AT_SUBTASKS, ROWS, kind_of, make, replay

EVERY = pytest.mark.parametrize("name", ROWS)


SEEDLESS = {"nearest", "r-maxent"}
"""Learners that draw nothing: every seed gives the same."""
DESCENDING = pytest.mark.parametrize("name", [name for name in ROWS if name != "nearest"])
"""Learners that lower a loss step by step; the nearest neighbour remembers."""


@pytest.fixture
def samples(name, samples, motions):
    """What the learner `name` is given: 5 demonstrations of 6 rows, the last of which errs."""
    return motions if kind_of(name).levels == ("joint",) else samples


def fit(name, samples, weights, seed=0):
    return make(name, seed=seed).fit(samples, np.asarray(weights, dtype=float))


def parameters(learner):
    return {name: value.numpy() for name, value in learner.policy_.network.state_dict().items()}


def assert_same(one, other, **tolerance):
    first, second = parameters(one), parameters(other)
    assert first.keys() == second.keys()
    for name, value in first.items():
        np.testing.assert_allclose(value, second[name], err_msg=name, **tolerance)


CLOSE = {"rtol": 1e-6, "atol": 1e-7}
"""The order of a sum may differ; what is learned may not."""


@EVERY
def test_weight_0_equals_the_demonstration_removed(name, samples):
    removed = samples.take(samples.demos != 4)
    assert_same(fit(name, samples, [1, 1, 1, 1, 0]), fit(name, removed, [1, 1, 1, 1]), rtol=0)


@EVERY
def test_weight_2_equals_the_demonstration_twice(name, samples):
    rows = np.arange(30)
    taken = samples.take(np.concatenate([rows, rows[samples.demos == 2]]))
    demos = np.where(np.arange(36) < 30, taken.demos, 5)
    twice = replace(taken, demos=demos)
    assert_same(fit(name, samples, [1, 1, 2, 1, 1]), fit(name, twice, np.ones(6)), **CLOSE)


@EVERY
def test_the_order_of_the_demonstrations_does_not_matter(name, samples):
    order = np.argsort(-samples.demos, kind="stable")
    assert_same(fit(name, samples, np.ones(5)), fit(name, samples.take(order), np.ones(5)), **CLOSE)


@EVERY
def test_only_the_proportions_of_weights_count(name, samples):
    assert_same(fit(name, samples, np.full(5, 0.37)), fit(name, samples, np.ones(5)), **CLOSE)


@EVERY
def test_weights_matter(name, samples):
    with_error = fit(name, samples, [1, 1, 1, 1, 1])
    without = fit(name, samples, [1, 1, 1, 1, 0])
    with pytest.raises(AssertionError):
        assert_same(with_error, without, **CLOSE)


@EVERY
def test_one_seed_one_result_whatever_the_global_state(name, samples):
    torch.manual_seed(1)
    first = fit(name, samples, np.ones(5))
    torch.manual_seed(2)
    threads = torch.get_num_threads()
    second = fit(name, samples, np.ones(5))
    assert torch.get_num_threads() == threads
    assert_same(first, second, rtol=0)
    assert first.history_ == second.history_
    other = fit(name, samples, np.ones(5), seed=1)
    if name in SEEDLESS:
        assert_same(first, other, rtol=0)
    else:
        with pytest.raises(AssertionError):
            assert_same(first, other, **CLOSE)


@EVERY
def test_fit_returns_self_and_leaves_the_settings(name, samples):
    learner = make(name)
    config = learner.config
    assert learner.fit(samples, np.ones(5)) is learner
    assert learner.config is config


@DESCENDING
def test_learning_lowers_the_loss(name, samples):
    learner = fit(name, samples, np.ones(5))
    assert learner.history_[-1] < 0.7 * learner.history_[0]


@pytest.mark.parametrize("name", AT_SUBTASKS)
def test_a_clear_majority_decides(name, samples):
    policy = fit(name, samples, np.ones(5)).policy_
    right = samples.take(samples.demos != 4)
    chosen = replay(policy, right).argmax(axis=1)
    assert (chosen == right.labels).mean() > 0.9


@EVERY
@pytest.mark.parametrize(
    ("weights", "sentence"),
    [
        ([0, 0, 0, 0, 0], "Every demonstration has weight 0, so there is nothing to learn from."),
        ([1, 1, 1, 1, -1], "A demonstration weight is negative or not a number."),
        ([1, 1, 1, 1, np.nan], "A demonstration weight is negative or not a number."),
        ([1, 1], "2 weights do not cover demonstration 4 of the pool."),
    ],
)
def test_weights_that_make_no_sense_are_refused(name, samples, weights, sentence):
    with pytest.raises(ConfigError) as error:
        fit(name, samples, weights)
    assert str(error.value) == sentence


def test_an_unknown_learner_or_level_names_the_choices():
    with pytest.raises(ConfigError) as error:
        find_learner("cb", "subtask")
    assert str(error.value) == f"Unknown learner 'cb'; choose {', '.join(LEARNERS)}."
    with pytest.raises(ConfigError) as error:
        find_learner("bcnd", "joint")
    assert str(error.value) == "The learner 'bcnd' has no level 'joint'; choose subtask."
    with pytest.raises(ConfigError) as error:
        find_learner("nearest", "subtask")
    assert str(error.value) == "The learner 'nearest' has no level 'subtask'; choose joint."


@DESCENDING
def test_no_learner_starts_with_settings_that_cannot_train(name):
    with pytest.raises(ConfigError, match="steps >= 1"):
        make(name, steps=0)


PLANS = (
    "A learner of joint targets needs chunk >= 1, batch >= 1, 0 <= ensemble < 1 and emphasis > 0."
)
SIZES = "A learner of joint targets needs width >= 1, blocks >= 0 and 0 <= averaging < 1."


@pytest.mark.parametrize(
    ("name", "settings", "sentence"),
    [
        (
            "bc",
            {"learning_rate": 0.0},
            "A learner needs steps >= 1, learning_rate > 0 and weight_decay >= 0.",
        ),
        ("bc", {"bottleneck": 0}, "bottleneck is 0; choose 1 or more."),
        ("bc-rnn", {"hidden": 0}, "bc-rnn needs hidden >= 1 and layers >= 1."),
        ("act", {"chunk": 0}, PLANS),
        ("act", {"ensemble": 1.0}, PLANS),
        ("bc@joint", {"emphasis": 0.0}, PLANS),
        ("act", {"averaging": 1.0}, SIZES),
        ("bc-rnn@joint", {"width": 0}, SIZES),
        ("bc-rnn@joint", {"horizon": 0}, "bc-rnn needs hidden >= 1 and horizon >= 1."),
        ("nearest", {"chunk": 0}, "chunk is 0; choose 1 or more."),
        ("bcnd", {"members": 0}, "bcnd needs members >= 1 and rounds >= 1."),
        ("demodice", {"gamma": 1.0}, "gamma is 1.0; choose more than 0 and less than 1."),
        (
            "demodice",
            {"alpha": -1.0},
            "demodice needs alpha >= 0, gradient_penalty >= 0 and nu_penalty >= 0.",
        ),
        (
            "demodice",
            {"hidden": 0},
            "demodice needs hidden >= 1, mixtures >= 1, ratio_steps >= 1 and "
            "ratio_learning_rate > 0.",
        ),
        ("r-maxent", {"trusted": 1.0}, "trusted is 1.0; choose more than 0 and less than 1."),
        ("r-maxent", {"ridge": 0.0}, "r-maxent needs ridge > 0 and steps >= 1."),
        ("r-maxent", {"coldest": 2.0}, "r-maxent needs 0 < coldest <= hottest."),
    ],
)
def test_settings_that_cannot_train_are_refused(name, settings, sentence):
    with pytest.raises(ConfigError) as error:
        kind_of(name).make(**settings)
    assert str(error.value) == sentence
