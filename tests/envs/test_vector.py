"""Several environments at once are copies of the single one, in this process or in others."""

import subprocess
import sys
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from teasim.envs.registration import register_envs

ROOT = Path(__file__).parents[2]
VIEW = {
    "obs_type": "pixels",
    "cameras": ("cup",),
    "width": 32,
    "height": 24,
    "render_mode": "rgb_array",
}
# Other tests have started threads in this process, after which it should not be forked.
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


FORK = """
import os, sys
import gymnasium, mujoco
import numpy as np

VIEW = {"obs_type": "pixels", "cameras": ("cup",), "width": 32, "height": 24}
NAME = "teasim:teasim/TeaMaking-v0"
env = gymnasium.make(NAME, **VIEW)
first, _ = env.reset(seed=3)
step = env.step(np.zeros(16))[0]
"""
ASYNC = """
for _ in range(2):  # also after OpenGL was left once
    envs = gymnasium.make_vec(NAME, num_envs=2, vectorization_mode="async", **VIEW)
    seen, _ = envs.reset(seed=[3, 3])
    assert (seen["pixels"] == first["pixels"]).all()
    envs.close()
    again, _ = env.reset(seed=3)
    assert (again["pixels"] == first["pixels"]).all()
    assert (env.step(np.zeros(16))[0]["pixels"] == step["pixels"]).all()
env.close()
print("the same pictures")
"""
OTHERS = """
other = mujoco.Renderer(mujoco.MjModel.from_xml_string("<mujoco/>"), 8, 8)
child = os.fork()
if not child:
    try:
        env.reset(seed=3)
    except Exception as error:
        print(type(error).__name__, error, flush=True)
    os._exit(0)
os.waitpid(child, 0)
other.render()
assert (env.reset(seed=3)[0]["pixels"] == first["pixels"]).all()
other.close()
env.close()
"""


def run_apart(program: str) -> str:
    """What `program` prints in a process of its own."""
    command = [sys.executable, "-c", program]
    return subprocess.run(command, cwd=ROOT, check=True, text=True, stdout=subprocess.PIPE).stdout


@pytest.mark.slow
def test_a_process_that_renders_can_be_forked_and_both_go_on():
    """Gymnasium's default; nobody has to know about 'spawn'."""
    assert run_apart(FORK + ASYNC).strip() == "the same pictures"


@pytest.mark.slow
def test_a_fork_is_refused_instead_of_hanging_while_another_library_renders():
    assert run_apart(FORK + OTHERS).strip() == (
        "RenderError This process was forked from one in which OpenGL was in use, and rendering "
        "would hang; start it with multiprocessing's 'spawn' (vector_kwargs={'context': 'spawn'})."
    )
