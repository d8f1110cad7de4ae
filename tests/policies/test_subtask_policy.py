"""How a policy is asked: one observation or a batch, the likeliest sub-task or a drawn one."""

import numpy as np
import pytest
import torch

from policies.data.features import camera_maps
from policies.data.samples import ObservationSpec
from policies.learners.networks import DecisionNetwork, NetworkShape
from policies.learners.subtask_policy import SubtaskPolicy
from teasim.constants import STATE_NAMES, SUBTASKS
from tests.policies.fakes import SIZE, picture

SPEC = ObservationSpec(("left", "cup"), SIZE, SIZE, STATE_NAMES)
CHANCES = np.array([0.4, 0.3, 0.1, 0.1, 0.1, 0.0, 0.0])


@pytest.fixture(scope="module")
def batch():
    random = np.random.default_rng(0)
    frames = np.stack([picture({0, 4}, random), picture(set(range(6)), random)])
    joints = random.normal(0, 0.1, (2, len(STATE_NAMES))).astype(np.float32)
    return {"pixels": {"left": frames, "cup": frames[::-1].copy()}, "agent_pos": joints}


def new_network(seed=0):
    return DecisionNetwork(NetworkShape(2, 112, len(STATE_NAMES), 4, len(SUBTASKS)), seed)


@pytest.fixture
def policy():
    """Sure of nothing: its probabilities are CHANCES whatever it sees."""
    network = new_network()
    with np.errstate(divide="ignore"):
        network.head.bias.data[:] = network.head.bias.new_tensor(np.log(CHANCES))
    return SubtaskPolicy(network, SPEC, SUBTASKS)


def first(batch):
    pixels = {camera: frames[0] for camera, frames in batch["pixels"].items()}
    return {"pixels": pixels, "agent_pos": batch["agent_pos"][0]}


def test_one_observation_gives_one_action_and_a_batch_gives_many(policy, batch):
    action, state = policy.predict(first(batch), deterministic=True)
    assert action.shape == ()
    assert action.dtype == np.int64
    assert state is None
    actions, _ = policy.predict(batch, None, np.ones(2, dtype=bool), deterministic=True)
    assert actions.shape == (2,)
    np.testing.assert_array_equal(actions, [0, 0])


def test_one_observation_and_a_batch_agree(batch):
    network = new_network()
    seeded = torch.Generator().manual_seed(0)
    network.head.weight.data.normal_(0, 0.01, generator=seeded)  # far from certain of anything
    policy = SubtaskPolicy(network, SPEC, SUBTASKS)
    (together, _), (alone, _) = policy.probabilities(batch), policy.probabilities(first(batch))
    np.testing.assert_allclose(together[0], alone, rtol=1e-4)
    assert np.abs(together[0] - together[1]).max() > 1e-6


def test_drawn_actions_follow_the_probabilities(policy, batch):
    many = {
        "pixels": {camera: frames.repeat(100, 0) for camera, frames in batch["pixels"].items()},
        "agent_pos": batch["agent_pos"].repeat(100, 0),
    }
    draws, _ = policy.predict(many)
    shares = np.bincount(draws, minlength=7) / 200
    np.testing.assert_allclose(shares, CHANCES, atol=0.08)
    assert shares[5:].sum() == 0


def test_a_seed_repeats_the_draws(policy, batch):
    def draw(seed):
        policy.set_random_seed(seed)
        return [policy.predict(batch)[0].tolist() for _ in range(8)]

    assert draw(3) == draw(3)
    assert draw(3) != draw(4)


def test_cameras_are_told_apart(batch):
    maps = camera_maps(batch["pixels"], ("left", "cup"))
    swapped = camera_maps(batch["pixels"], ("cup", "left"))
    assert maps.shape == (2, 2, 112, 4, 4)
    np.testing.assert_array_equal(maps, swapped[:, ::-1])
    assert np.abs(maps - swapped).max() > 0


def test_where_things_are_does_not_matter():
    random = np.random.default_rng(0)
    network = new_network()
    network.head.weight.data.normal_()
    maps = random.normal(size=(3, 2, 112, 4, 4))
    joints = torch.zeros(3, len(STATE_NAMES))
    moved = np.roll(maps, (1, 2), axis=(3, 4))
    logits = [network(torch.from_numpy(m), joints).detach() for m in (maps, moved)]
    torch.testing.assert_close(logits[0], logits[1])
