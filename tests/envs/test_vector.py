"""Several environments at once are copies of the single one, in this process or in others."""

import os

import gymnasium
import numpy as np
import pytest

from teasim.common.errors import RenderError
from teasim.envs.registration import register_envs

VIEW = {
    "obs_type": "pixels",
    "cameras": ("cup",),
    "width": 32,
    "height": 24,
    "render_mode": "rgb_array",
}
# A process that has rendered, as this one, cannot be forked.
SPAWN = {"vector_kwargs": {"context": "spawn"}}
MODES = {"sync": {}, "async": SPAWN}


def start_and_step(mode: str, name: str) -> tuple:
    register_envs()
    envs = gymnasium.make_vec(
        f"teasim:teasim/{name}-v0", num_envs=2, vectorization_mode=mode, **MODES[mode], **VIEW
    )
    first, _ = envs.reset(seed=3)
    action = np.zeros(envs.action_space.shape, envs.action_space.dtype)
    second, rewards, *ends, info = envs.step(action)
    pictures = envs.render()
    envs.close()
    return first["pixels"], second["pixels"], rewards, ends, info, pictures


@pytest.mark.parametrize(
    ("mode", "name"),
    [
        ("sync", "TeaMaking"),
        ("async", "TeaMaking"),
        ("sync", "TeaMakingSubtasks"),
        pytest.param("async", "TeaMakingSubtasks", marks=pytest.mark.slow),
    ],
)
def test_vector_environments_are_copies_of_the_single_one(make, request, mode, name):
    if mode == "sync":  # other processes have no patched skills
        request.getfixturevalue("quick")
    first, second, rewards, ends, info, pictures = start_and_step(mode, name)
    assert isinstance(pictures, tuple)
    assert not np.any(ends)
    env = make(name, **VIEW)
    for k in range(2):
        observation, _ = env.reset(seed=3 + k)
        assert (first[k] == observation["pixels"]).all()
        action = np.zeros(env.action_space.shape, env.action_space.dtype)
        observation, reward, _, _, single = env.step(action)
        assert (second[k] == observation["pixels"]).all()
        assert (pictures[k] == env.render()).all()
        assert (rewards[k], info["time"][k]) == (reward, single["time"])
        assert info["subtasks_done"][k] == single["subtasks_done"]
        for term, value in single["reward_terms"].items():
            assert info["reward_terms"][term][k] == value
    assert (first[0] != first[1]).any()


def test_a_fork_of_a_process_that_renders_is_refused_instead_of_hanging(monkeypatch, make):
    parent = os.getpid() + 1
    monkeypatch.setattr("teasim.render._processes", {parent})
    env = make("TeaMaking", **VIEW)
    with pytest.raises(RenderError) as error:
        env.reset(seed=0)
    assert str(error.value) == (
        "This process was forked from one that has rendered, which OpenGL does not survive; "
        "start it with multiprocessing's 'spawn' (vector_kwargs={'context': 'spawn'})."
    )
