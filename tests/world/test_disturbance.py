"""The offsets of execution noise are slow, independent, and of the size that was asked for."""

from itertools import islice

import numpy as np
import pytest

from teasim.constants import CONTROL_TIMESTEP
from teasim.world.disturbance import disturbances

JOINTS = 14
STEPS = 20_000


def offsets(sigma: float, seed: int = 0) -> np.ndarray:
    """Offsets (STEPS, JOINTS + 2)."""
    rng = np.random.default_rng(seed)
    return np.array(list(islice(disturbances(sigma, JOINTS, rng), STEPS)))


@pytest.mark.parametrize("sigma", [0.002, 0.01])
def test_every_joint_has_the_standard_deviation_that_was_asked_for(sigma):
    found = offsets(sigma)[:, :JOINTS]
    assert found.std(axis=0) == pytest.approx(sigma, rel=0.1)
    assert np.abs(found.mean(axis=0)).max() < 0.1 * sigma
    assert np.abs(np.corrcoef(found.T) - np.eye(JOINTS)).max() < 0.1


def test_the_grippers_are_not_disturbed():
    assert not offsets(0.01)[:, JOINTS:].any()


def test_offsets_begin_small_and_change_slowly():
    found = offsets(0.01)[:, :JOINTS]
    assert np.abs(found[0]).max() < 0.5 * 0.01
    speeds = np.diff(found, axis=0) / CONTROL_TIMESTEP
    assert speeds.std() < 3 * 0.01  # [rad/s]; that of white noise would be 14 times sigma


def test_a_seed_gives_one_disturbance():
    assert offsets(0.01).tobytes() == offsets(0.01).tobytes()
    assert offsets(0.01).tobytes() != offsets(0.01, seed=1).tobytes()
