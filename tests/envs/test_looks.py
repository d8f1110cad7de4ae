"""Environments whose pictures vary, and what else can be asked of their cameras."""

import gymnasium
import numpy as np
import pytest

from teasim.common.errors import ConfigError
from teasim.world.segments import SEGMENT_NAMES

NAME = "teasim:teasim/TeaMaking-v0"


@pytest.fixture(scope="module")
def varied():
    env = gymnasium.make(
        NAME, obs_type="pixels", cameras=("left",), width=64, height=64, look="random"
    )
    yield env.unwrapped
    env.close()


def test_every_episode_looks_different_and_a_seed_repeats_the_look(varied):
    first, _ = varied.reset(seed=1)
    second, _ = varied.reset(seed=2)
    again, _ = varied.reset(seed=1)
    assert np.array_equal(first["pixels"], again["pixels"])
    assert (first["pixels"] != second["pixels"]).mean() > 0.2


def test_going_back_brings_back_the_look(varied):
    varied.reset(seed=3)
    kept, picture = varied.get_state(), varied._observation()["pixels"]
    varied.reset(seed=4)
    varied.set_state(kept)
    assert np.array_equal(varied._observation()["pixels"], picture)


def test_masks_and_depths_are_given_on_request(varied):
    observation, _ = varied.reset(seed=5)
    mask, depth = varied.masks()["left"], varied.depths()["left"]
    assert mask.shape == depth.shape == observation["pixels"].shape[:2]
    assert "kettle" in {SEGMENT_NAMES[k] for k in np.unique(mask)}
    assert (depth > 0).all()
    assert np.array_equal(varied._observation()["pixels"], observation["pixels"])


def test_an_unknown_look_is_named_with_the_choices():
    with pytest.raises(ConfigError, match="Unknown look 'odd'; choose fixed, random"):
        gymnasium.make(NAME, look="odd")
