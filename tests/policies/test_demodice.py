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
    good = np.isin(samples.demos, experts)
    count = len(np.unique(samples.demos))
    return make_chain(encoder, samples, np.full(len(samples.labels), 1 / count), good)


def exact(**settings):
    """Without penalties, and trained until nothing moves, c and nu are what they estimate."""
    free = {"gradient_penalty": 0.0, "nu_penalty": 0.0, "mixtures": 1}
    return DemoDICEConfig(**free, ratio_steps=600, ratio_learning_rate=1e-2, **settings)


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
    free = {"gradient_penalty": 0.0, "nu_penalty": 0.0, "ratio_steps": 300, "mixtures": 1}
    learner = make("demodice", experts=EXPERTS, alpha=alpha, steps=400, **free)
    policy = learner.fit(bandit(), np.ones(8)).policy_
    odds = 3 ** (1 / (1 + alpha))
    chances, _ = policy.decide(np.zeros((1, 0, 0, 1, 1), np.float16), np.zeros((1, 1), np.float32))
    np.testing.assert_allclose(chances[0], [odds / (1 + odds), 1 / (1 + odds)], atol=0.03)


THINGS = 20
"""Numbers of the state that have nothing to do with the decision: where things happen to stand."""


def corridor(labels, spread):
    """Demonstrations (D, 3) of two choices in three states in a row; things vary by `spread`."""
    count, length = labels.shape
    things = np.random.default_rng(0).normal(0, spread, (labels.size, THINGS))
    states = np.hstack([np.tile(np.eye(length), (count, 1)), things])
    return DecisionSamples(
        np.zeros((labels.size, 1, 0, 0, 1, 1), dtype=np.float16),
        states.astype(np.float32),
        labels.ravel().astype(np.int64),
        np.repeat(np.arange(count), length),
        ObservationSpec((), 0, 0, tuple(f"number_{n}" for n in range(length + THINGS))),
        ("a", "b"),
    )


def erring(count, of):
    """Choices (of, 3), 0 throughout; the last `count` demonstrations take 1 in the second state."""
    labels = np.zeros((of, 3), dtype=np.int64)
    labels[of - count :, 1] = 1
    return labels


def mean_weights(learner):
    """Weight of the decisions in the second state: of those that took 0, of those that took 1."""
    weights = learner.decision_weights_.reshape(-1, 3)[:, 1]
    labels = learner.samples_.labels.reshape(-1, 3)[:, 1]
    return tuple(weights[labels == kind].mean() for kind in (0, 1))


def test_what_experts_never_do_counts_less():
    """Three states in a row; the last of five demonstrations errs in the second."""
    samples = corridor(erring(1, of=5), spread=0.0)
    learner = make("demodice", experts=(0,), ratio_steps=300).fit(samples, np.ones(5))
    right, wrong = mean_weights(learner)
    assert wrong < 0.5 * right


FEW = {"experts": (0, 1), "ratio_steps": 200, "mixtures": 32}
"""Two experts, three other good demonstrations and seven that err, in states that never recur."""


def test_a_free_nu_cancels_the_rewards_where_no_state_recurs():
    """Every demonstration is a chain of its own, so the flow leaves nothing to choose."""
    samples = corridor(erring(7, of=12), spread=0.3)
    learner = make("demodice", nu_penalty=0.0, **FEW).fit(samples, np.ones(12))
    np.testing.assert_allclose(learner.decision_weights_, 1.0, atol=0.03)
    right, wrong = mean_weights(learner)
    assert wrong == pytest.approx(right, rel=1e-3)


def corrections_of(chain, rewards, gamma):
    """Estimates of d / d_U with a free nu: for each demonstration (D, 3), and at the end."""
    config = exact(gamma=gamma)
    found = np.exp(learn_advantages(chain, rewards, config) / (1 + config.alpha))
    found /= chain.union.numpy() @ found
    return found[:-1].reshape(-1, 3), found[-1]


def drawn_rewards(chain):
    return torch.from_numpy(np.random.default_rng(1).normal(0, 1, len(chain.union)))


@pytest.mark.parametrize("gamma", [0.5, 0.9])
def test_on_separate_chains_the_flow_alone_decides_whatever_the_rewards_are(gamma):
    """d of step t is (1 - gamma) gamma^t, and d_U one visit of four: three steps and the end."""
    chain = chain_of(corridor(erring(7, of=12), spread=0.3))
    steps, end = corrections_of(chain, drawn_rewards(chain), gamma)
    flow = (1 - gamma) * gamma ** np.arange(3)
    np.testing.assert_allclose(steps, np.tile(4 * flow, (12, 1)), rtol=0.01)
    assert end == pytest.approx(4 * gamma**3, rel=0.01)


def test_where_a_state_recurs_its_choices_differ_by_their_rewards():
    """Both choices of the second state lead to the third, so nu cannot tell them apart."""
    chain = chain_of(corridor(erring(7, of=12), spread=0.0))
    rewards = drawn_rewards(chain)
    steps, _ = corrections_of(chain, rewards, gamma=0.5)
    second = rewards[:-1].reshape(-1, 3)[:, 1].numpy()
    expected = np.exp((second - second[0]) / (1 + exact().alpha))
    np.testing.assert_allclose(steps[:, 1] / steps[0, 1], expected)


def test_a_smooth_nu_separates_them_and_plain_cloning_follows_the_majority():
    samples = corridor(erring(7, of=12), spread=0.3)
    learner = make("demodice", steps=300, nu_penalty=0.1, **FEW).fit(samples, np.ones(12))
    right, wrong = mean_weights(learner)
    assert wrong < 0.3 * right
    cloned = make("bc", steps=300).fit(samples, np.ones(12)).policy_
    second = (np.zeros((1, 0, 0, 1, 1), np.float16), np.eye(3 + THINGS, dtype=np.float32)[1:2])
    assert cloned.decide(*second)[0].argmax() == 1
    assert learner.policy_.decide(*second)[0].argmax() == 0


def test_the_chain_follows_each_demonstration_to_the_end(samples):
    encoder = Encoder(NetworkShape(2, 4, 2, 0, 3), torch.Generator())
    chain = make_chain(encoder, samples, np.full(30, 1 / 30), samples.demos == 1)
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
