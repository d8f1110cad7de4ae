"""Pools of the fake station and samples that need no pictures."""

import numpy as np
import pytest

from policies.data.demos import DemosConfig, load_decisions
from policies.data.motions import MotionSamples
from policies.data.samples import DecisionSamples, ObservationSpec
from tests.policies.fake_joints import make_joint_pool
from tests.policies.fakes import SEQ_1, make_fake_pool

WITHOUT_TEA_BAG = tuple(action for action in SEQ_1 if action != 4)


@pytest.fixture(scope="session")
def fake_pool(tmp_path_factory):
    """Six correct demonstrations and one that leaves out the tea bag."""
    path = tmp_path_factory.mktemp("pools") / "fake"
    return make_fake_pool(path, [SEQ_1] * 6 + [WITHOUT_TEA_BAG])


@pytest.fixture(scope="session")
def decisions(fake_pool):
    """What is learned from `fake_pool`, with one altered view."""
    return load_decisions(fake_pool, DemosConfig(copies=1))


@pytest.fixture(scope="session")
def human_pool(tmp_path_factory):
    """One demonstration without a joint log."""
    return make_fake_pool(tmp_path_factory.mktemp("pools") / "human", [SEQ_1], joints=False)


@pytest.fixture(scope="session")
def samples():
    """30 noisy decisions among 3 sub-tasks by 5 demonstrations, the last of which errs.

    One channel per sub-task is lit, somewhere in the picture of one of two cameras; two views.
    """
    random = np.random.default_rng(0)
    labels = np.tile(np.arange(3), 10)
    maps = random.normal(0, 0.3, (30, 2, 2, 4, 3, 3)).astype(np.float16)
    for decision, label in enumerate(labels):
        for view in range(2):
            row, column = random.integers(0, 3, 2)
            maps[decision, view, label % 2, label, row, column] += 3
    demos = np.repeat(np.arange(5), 6)
    labels[demos == 4] = (labels[demos == 4] + 1) % 3
    joints = random.normal(0, 1e-3, (30, 2)).astype(np.float32)
    spec = ObservationSpec(("left", "cup"), 48, 48, ("shoulder", "elbow"))
    return DecisionSamples(maps, joints, labels, demos, spec, ("a", "b", "c"))


@pytest.fixture(scope="session")
def motions():
    """5 demonstrations of 6 control steps: two joints on a circle, the last the other way round."""
    angles = np.tile(np.arange(6) / 6 * 2 * np.pi, 5)
    demos = np.repeat(np.arange(5), 6)
    angles[demos == 4] *= -1
    random = np.random.default_rng(0)
    low_dim = np.stack([np.cos(angles), np.sin(angles), np.tile(np.arange(6), 5)], axis=1)
    low_dim[:, :2] += random.normal(0, 0.02, (30, 2))
    ahead = angles + np.where(demos == 4, -1, 1) * 2 * np.pi / 6
    targets = np.stack([np.cos(ahead), np.sin(ahead)], axis=1)
    spec = ObservationSpec((), 0, 0, ("shoulder", "elbow"), ("clock",))
    return MotionSamples(
        low_dim.astype(np.float32), targets.astype(np.float32), demos, spec, ("shoulder", "elbow")
    )


@pytest.fixture(scope="session")
def joint_pool(tmp_path_factory):
    """Four demonstrations of the fake joints, each at a tempo of its own."""
    return make_joint_pool(tmp_path_factory.mktemp("pools") / "joints")
