"""Round after round the majority wins."""

import numpy as np
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


def test_the_second_round_is_what_the_rule_says():
    """w_i pi_old(t_i): 3/4 * 3/4 against 1/4 * 1/4, so the minority keeps 1/10."""
    found = chance_of_the_minority(rounds=2, steps=300)
    np.testing.assert_allclose(found, 0.1, atol=2e-3)


def test_more_rounds_leave_the_minority_less():
    found = [chance_of_the_minority(rounds=rounds, steps=100) for rounds in (1, 2, 3)]
    assert found[0] > 2 * found[1] > 4 * found[2]


def test_the_ensemble_is_the_mean_of_its_members(samples):
    network = make("bcnd", steps=5, rounds=1).fit(samples, np.ones(5)).policy_.network
    seen = (torch.from_numpy(samples.maps[:, 0].copy()), torch.from_numpy(samples.low_dim.copy()))
    together = network(*seen).exp()
    alone = torch.stack([member(*seen).softmax(dim=1) for member in network.members])
    torch.testing.assert_close(together, alone.mean(dim=0))
    assert (alone[0] - alone[1]).abs().max() > 1e-6
