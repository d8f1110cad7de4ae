"""Pools of the fake station and samples that need no pictures."""

import numpy as np
import pytest

from policies.base import DecisionSamples, ObservationSpec
from tests.policies.fakes import SEQ_1, make_fake_pool

WITHOUT_TEA_BAG = tuple(action for action in SEQ_1 if action != 4)


@pytest.fixture(scope="session")
def fake_pool(tmp_path_factory):
    """Six correct demonstrations and one that leaves out the tea bag."""
    path = tmp_path_factory.mktemp("pools") / "fake"
    return make_fake_pool(path, [SEQ_1] * 6 + [WITHOUT_TEA_BAG])


@pytest.fixture(scope="session")
def human_pool(tmp_path_factory):
    """One demonstration without a joint log."""
    return make_fake_pool(tmp_path_factory.mktemp("pools") / "human", [SEQ_1], joints=False)


@pytest.fixture(scope="session")
def samples():
    """30 noisy decisions among 3 sub-tasks by 5 demonstrations, the last of which errs."""
    random = np.random.default_rng(0)
    labels = np.tile(np.arange(3), 10)
    inputs = random.normal(0, 0.6, (30, 8)).astype(np.float32)
    inputs[np.arange(30), labels] += 2
    demos = np.repeat(np.arange(5), 6)
    labels[demos == 4] = (labels[demos == 4] + 1) % 3
    shares = np.where(np.arange(30) % 6 < 2, 0.5, 1.0)
    return DecisionSamples(
        inputs, labels, demos, shares, ObservationSpec(("left",), 8, 8), tuple("abc")
    )
