"""Round after round the majority wins."""

import numpy as np
import pytest
import torch

from policies.data.samples import DecisionSamples, ObservationSpec
from tests.policies.learning import make, replay


def disputed():
    """One state; three of four decisions are 0, the other is 1."""
    labels = np.arange(40) % 4 == 3
    maps = np.zeros((40, 1, 0, 0, 1, 1), dtype=np.float16)
    low_dim = np.zeros((40, 1), dtype=np.float32)
    spec = ObservationSpec((), 0, 0, ("x",))
    return DecisionSamples(
        maps, low_dim, labels.astype(np.int64), np.arange(40) // 4, spec, ("a", "b")
    )


def chance_of_the_minority(**settings):
    policy = (
        make("bcnd", weight_decay=0.0, learning_rate=3e-2, **settings)
        .fit(disputed(), np.ones(10))
        .policy_
    )
    return replay(policy, disputed())[0, 1]


def test_one_round_is_behaviour_cloning():
    found = chance_of_the_minority(rounds=1, steps=200)
    np.testing.assert_allclose(found, 0.25, atol=1e-3)


def test_every_round_is_what_the_rule_says():
    """w_i pi_old(t_i): 3/4 * 3/4 against 1/4 * 1/4 leaves the minority 1/10, then 1/28."""
    np.testing.assert_allclose(chance_of_the_minority(rounds=2, steps=300), 1 / 10, atol=2e-3)
    np.testing.assert_allclose(chance_of_the_minority(rounds=3, steps=300), 1 / 28, atol=2e-3)


def walks(labels):
    """Demonstrations (D, 6) of two choices along a chain of six states."""
    count, length = labels.shape
    spec = ObservationSpec((), 0, 0, tuple("abcdef"))
    return DecisionSamples(
        np.zeros((labels.size, 1, 0, 0, 1, 1), dtype=np.float16),
        np.tile(np.eye(length, dtype=np.float32), (count, 1)),
        labels.ravel().astype(np.int64),
        np.repeat(np.arange(count), length),
        spec,
        ("on", "off"),
    )


def test_a_noisy_expert_is_recovered_and_plain_cloning_copies_the_noise():
    """Every fourth decision is wrong: cloned, a walk of six succeeds with 0.75^6 = 18 %."""
    wrong = np.arange(20) % 4 == 3
    orders = [np.random.default_rng(state).permutation(wrong) for state in range(6)]
    noisy = walks(np.stack(orders, axis=1))
    whole = {}
    for name, settings in {"bc": {}, "bcnd": {"rounds": 5}}.items():
        settings |= {"weight_decay": 0.0, "learning_rate": 3e-2, "steps": 150}
        policy = make(name, **settings).fit(noisy, np.ones(20))
        whole[name] = replay(policy.policy_, noisy)[:6, 0].prod()
    assert whole["bc"] == pytest.approx(0.75**6, abs=1e-3)
    assert whole["bcnd"] > 0.8


def test_members_learn_from_disjoint_parts():
    """As many members as demonstrations: each decides as one of them, which had its own mind."""
    labels = np.array([[0, 0, 0, 0, 0, 0], [1, 0, 1, 0, 1, 0], [1, 1, 1, 0, 0, 0]])
    learner = make("bcnd", members=3, rounds=1, steps=200, learning_rate=5e-2)
    network = learner.fit(walks(labels), np.ones(3)).policy_.network
    maps, states = torch.zeros(6, 0, 0, 1, 1), torch.eye(6)
    minds = [member(maps, states).argmax(dim=1).tolist() for member in network.members]
    assert sorted(minds) == sorted(labels.tolist())


def test_there_are_no_more_members_than_different_demonstrations():
    learner = make("bcnd", members=5, rounds=1, steps=1)
    assert len(learner.fit(disputed(), np.ones(10)).policy_.network.members) == 1


def test_every_round_begins_with_new_members():
    """The loss at the beginning of a round is that of members that know nothing."""
    learner = make("bcnd", members=2, rounds=3, steps=20).fit(walks(np.eye(6)), np.ones(6))
    np.testing.assert_allclose(np.array(learner.history_)[[0, 20, 40]], np.log(2), rtol=1e-6)


def test_the_ensemble_is_the_mean_of_its_members(samples):
    network = make("bcnd", steps=5, rounds=1).fit(samples, np.ones(5)).policy_.network
    seen = (torch.from_numpy(samples.maps[:, 0].copy()), torch.from_numpy(samples.low_dim.copy()))
    together = network(*seen).exp()
    alone = torch.stack([member(*seen).softmax(dim=1) for member in network.members])
    torch.testing.assert_close(together, alone.mean(dim=0))
    assert (alone[0] - alone[1]).abs().max() > 1e-6
