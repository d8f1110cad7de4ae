"""A process whose density ratios are known, and what the ratios do to a policy."""

import numpy as np
import pytest
import torch

from policies.data.samples import DecisionSamples, ObservationSpec
from policies.learners.demodice import DemoDICEConfig, learn_advantages, learn_rewards, make_chain
from policies.learners.networks import Encoder, NetworkShape
from teasim.common.errors import ConfigError
from tests.policies.learning import make


def bandit():
    """Eight demonstrations of one decision each between 0 and 1.

    The experts 0 to 3 take 0 three times of four; all eight take it four times of eight.
    """
    labels = np.array([0, 0, 0, 1, 1, 1, 1, 0])
    spec = ObservationSpec((), 0, 0, ("x",))
    maps = np.zeros((8, 1, 0, 0, 1, 1), dtype=np.float16)
    return DecisionSamples(
        maps, np.zeros((8, 1), dtype=np.float32), labels, np.arange(8), spec, ("a", "b")
    )


EXPERTS = (0, 1, 2, 3)


def chain_of(samples, experts=EXPERTS):
    encoder = Encoder(
        NetworkShape(0, 0, samples.low_dim.shape[1], 0, samples.n_actions), torch.Generator()
    )
    return make_chain(encoder, samples, np.full(len(samples.labels), 1 / 8), experts)


def exact(**settings):
    """Without the penalty, and trained until nothing moves, c and nu are what they estimate."""
    return DemoDICEConfig(
        gradient_penalty=0.0, ratio_steps=600, ratio_learning_rate=1e-2, **settings
    )


def test_the_rewards_are_the_logarithms_of_the_density_ratios():
    rewards = learn_rewards(chain_of(bandit()), exact()).numpy()
    good, bad, over = rewards[0], rewards[3], rewards[8]
    # d_E / d_U: (3/4) / (1/2) for 0, (1/4) / (1/2) for 1, and all demonstrations come to an end.
    np.testing.assert_allclose(np.exp([good, bad, over]), [1.5, 0.5, 1.0], atol=0.01)


def test_without_alpha_the_corrections_are_the_density_ratios():
    """gamma 1/2 makes d_E visits of the process: half of them first decisions, half the end."""
    config = exact(alpha=0.0, gamma=0.5)
    chain = chain_of(bandit())
    corrections = np.exp(learn_advantages(chain, learn_rewards(chain, config), config))
    corrections /= chain.union.numpy() @ corrections
    np.testing.assert_allclose(corrections[[0, 3, 8]], [1.5, 0.5, 1.0], atol=0.02)
    assert chain.union.numpy() @ corrections == pytest.approx(1)


@pytest.mark.parametrize("alpha", [0.05, 1.0])
def test_alpha_pulls_the_policy_towards_the_union(alpha):
    """pi*(0) / pi*(1) = (d_E ratio)^(1 / (1 + alpha)), since both lead to the same state."""
    learner = make("demodice", experts=EXPERTS, alpha=alpha, gradient_penalty=0.0, steps=400)
    policy = learner.fit(bandit(), np.ones(8)).policy_
    odds = 3 ** (1 / (1 + alpha))
    chances, _ = policy.decide(np.zeros((1, 0, 0, 1, 1), np.float16), np.zeros((1, 1), np.float32))
    np.testing.assert_allclose(chances[0], [odds / (1 + odds), 1 / (1 + odds)], atol=0.03)


def test_what_experts_never_do_counts_less():
    """Three states in a row; the last of five demonstrations errs in the second."""
    labels = np.zeros((5, 3), dtype=np.int64)
    labels[4, 1] = 1
    states = np.tile(np.eye(3, dtype=np.float32), (5, 1))
    spec = ObservationSpec((), 0, 0, ("x", "y", "z"))
    maps = np.zeros((15, 1, 0, 0, 1, 1), dtype=np.float16)
    samples = DecisionSamples(
        maps, states, labels.ravel(), np.repeat(np.arange(5), 3), spec, ("a", "b")
    )
    learner = make("demodice", experts=(0,), ratio_steps=300).fit(samples, np.ones(5))
    by_demo = learner.decision_weights_.reshape(5, 3)
    np.testing.assert_allclose(by_demo[1:4], by_demo[:3], rtol=1e-9)
    assert by_demo[4, 1] < 0.3 * by_demo[3, 1]


def test_the_chain_follows_each_demonstration_to_the_end(samples):
    encoder = Encoder(NetworkShape(2, 4, 2, 0, 3), torch.Generator())
    chain = make_chain(encoder, samples, np.full(30, 1 / 30), (1,))
    assert chain.following[:6].tolist() == [1, 2, 3, 4, 5, 30]
    assert chain.following[30] == 30
    assert np.flatnonzero(chain.first).tolist() == [0, 6, 12, 18, 24]
    np.testing.assert_allclose(chain.union, [1 / 35] * 30 + [5 / 35])
    np.testing.assert_allclose(chain.expert[[0, 6, 11, 12, 30]], [0, 1 / 7, 1 / 7, 0, 1 / 7])
    assert chain.states[30].tolist() == [0] * 10 + [1]


@pytest.mark.parametrize(("experts", "weights"), [((), [1] * 5), ((4,), [1, 1, 1, 1, 0])])
def test_no_expert_left_is_refused(samples, experts, weights):
    with pytest.raises(ConfigError) as error:
        make("demodice", experts=experts).fit(samples, np.array(weights, dtype=float))
    assert str(error.value) == (
        "demodice needs demonstrations that are known to be good and are not left out; "
        "name their episodes with --expert."
    )
