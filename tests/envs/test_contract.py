"""What Gymnasium, Stable-Baselines3 and users of both environments rely on."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from stable_baselines3.common.env_checker import check_env as check_env_sb3

from teasim.common.errors import ConfigError
from teasim.constants import CAMERAS, SUBTASKS
from teasim.envs.observations import OBS_TYPES
from teasim.task.scoring import judge
from tests.envs.fingerprint import fingerprint

ROOT = Path(__file__).parents[2]
NAMES = ("TeaMaking", "TeaMakingSubtasks")
ONE_CAMERA = {"cameras": ("cup",), "width": 64, "height": 64}
VIEWS = {
    "state": {"obs_type": "state"},
    "pixels": {"obs_type": "pixels", **ONE_CAMERA},
    "pixels_agent_pos": {"obs_type": "pixels_agent_pos", **ONE_CAMERA},
    "pixels_state": {"obs_type": "pixels_state", **ONE_CAMERA},
}
SEVERAL = {"obs_type": "pixels_agent_pos", "width": 64, "height": 64}
INFO = {
    "success": bool,
    "is_success": bool,
    "subtasks": tuple,
    "subtasks_done": tuple,
    "correct_action": int,
    "allowed_actions": tuple,
    "violations": tuple,
    "unsafe": bool,
    "time": np.float64,
}

each_env = pytest.mark.parametrize("name", NAMES)


@each_env
@pytest.mark.parametrize("view", VIEWS)
@pytest.mark.usefixtures("quick")
def test_the_checkers_of_gymnasium_and_stable_baselines_find_nothing(make, name, view):
    env = make(name, render_mode="rgb_array", **VIEWS[view])
    check_env(env.unwrapped)
    check_env_sb3(env.unwrapped)


@each_env
@pytest.mark.usefixtures("quick")
def test_the_checker_of_gymnasium_finds_nothing_with_several_cameras(make, name):
    # Stable-Baselines3 knows no dict within a dict.
    check_env(make(name, render_mode="rgb_array", **SEVERAL).unwrapped)


@each_env
def test_observation_keys_are_the_conventional_ones(make, name):
    spaces = {view: make(name, **kwargs).observation_space for view, kwargs in VIEWS.items()}
    assert set(spaces["state"].spaces) == {"agent_pos", "environment_state"}
    assert set(spaces["pixels"].spaces) == {"pixels"}
    assert set(spaces["pixels_agent_pos"].spaces) == {"agent_pos", "pixels"}
    assert set(spaces["pixels_state"].spaces) == {"agent_pos", "environment_state", "pixels"}
    assert spaces["pixels"]["pixels"].shape == (64, 64, 3)
    several = make(name, cameras=CAMERAS, **SEVERAL).observation_space
    assert set(several["pixels"].spaces) == set(CAMERAS)


@each_env
def test_the_initial_state_varies_with_the_seed_and_only_with_it(make, name):
    env = make(name)
    states = [env.reset(seed=seed)[0]["environment_state"] for seed in (0, 1, 0)]
    assert states[0].tobytes() == states[2].tobytes()
    assert np.abs(states[0] - states[1]).max() > 0.005
    assert env.reset()[0]["environment_state"].tobytes() != states[2].tobytes()


@each_env
def test_without_randomize_everything_is_in_its_nominal_place(make, name):
    env = make(name, randomize=False)
    states = [env.reset(seed=seed)[0]["environment_state"] for seed in (0, 1)]
    assert states[0].tobytes() == states[1].tobytes()


@each_env
def test_infos_hold_what_policies_are_scored_by(make, name):
    env = make(name)
    _, info = env.reset(seed=0)
    assert {key: type(info[key]) for key in INFO} == INFO
    assert info["subtasks"] == SUBTASKS
    assert info["subtasks_done"] == ()
    assert info["correct_action"] == SUBTASKS.index("turn_on_oven")
    assert info["allowed_actions"] == (info["correct_action"],)


@pytest.mark.parametrize(
    ("name", "actions", "obs_type"),
    [("TeaMaking", 5, "pixels_agent_pos"), ("TeaMakingSubtasks", 1, "state")],
)
def test_another_process_sees_the_same_bits(name, actions, obs_type):
    command = [sys.executable, "-m", "tests.envs.fingerprint", name, str(actions), obs_type]
    theirs = subprocess.check_output(command, cwd=ROOT, text=True)
    assert theirs.strip() == fingerprint(name, actions, obs_type)


@each_env
def test_pictures_are_those_of_the_first_camera(make, name):
    view = {"obs_type": "pixels", "width": 64, "height": 48}
    env = make(name, render_mode="rgb_array", cameras=("cup", "left"), **view)
    observation, _ = env.reset(seed=0)
    picture = env.render()
    assert (picture.shape, picture.dtype) == ((48, 64, 3), np.uint8)
    assert (picture == observation["pixels"]["cup"]).all()
    assert (picture != observation["pixels"]["left"]).any()


@each_env
def test_a_film_shows_every_control_step_of_an_action(make, name):
    view = {"obs_type": "pixels", "width": 64, "height": 48, "cameras": ("left", "cup")}
    env, quiet = make(name, render_mode="rgb_array_list", **view), make(name, **view)
    for one in (env, quiet):
        one.reset(seed=0)
    (first,) = env.render()
    assert first.shape == (48, 128, 3)
    assert env.render() == []
    action = env.action_space.sample() if name == "TeaMaking" else 0
    (seen, *_), (other, *_) = (one.step(action) for one in (env, quiet))
    assert all(
        (seen["pixels"][camera] == other["pixels"][camera]).all() for camera in ("left", "cup")
    )
    taken = env.render()
    assert (len(taken) == 1) == (name == "TeaMaking")
    assert (taken[-1] == np.hstack([seen["pixels"]["left"], seen["pixels"]["cup"]])).all()
    if name == "TeaMakingSubtasks":
        assert len(taken) > 20
        assert len({picture.tobytes() for picture in taken}) > len(taken) / 2


@each_env
def test_closing_twice_is_harmless_and_pictures_come_back(make, name):
    env = make(name, render_mode="rgb_array", obs_type="pixels", **ONE_CAMERA)
    before, _ = env.reset(seed=0)
    env.close()
    env.close()
    after, _ = env.reset(seed=0)
    assert (before["pixels"] == after["pixels"]).all()
    assert env.metadata["render_fps"] == 10


@each_env
def test_there_is_no_picture_without_a_render_mode(make, name):
    env = make(name).unwrapped
    env.reset(seed=0)
    assert env.render() is None


@pytest.mark.parametrize("start", ["import teasim", "import gymnasium, teasim", ""])
@pytest.mark.parametrize("prefix", ["teasim:", ""])
def test_the_environments_are_found_however_teasim_was_imported(start, prefix):
    if not start and not prefix:
        return  # nothing says that teasim is meant
    program = f"""
import sys
{start}
assert "gymnasium" in sys.modules or not {{"numpy", "mujoco"}} & set(sys.modules)
import gymnasium
assert gymnasium.make("{prefix}teasim/TeaMaking-v0").spec.max_episode_steps == 1800
hooks = [type(finder).__module__ for finder in sys.meta_path]
assert "teasim" not in hooks, hooks
assert type(gymnasium.__spec__.loader) is type(gymnasium.spaces.__spec__.loader)
assert gymnasium.__loader__ is gymnasium.__spec__.loader
"""
    subprocess.run([sys.executable, "-c", program], cwd=ROOT, check=True)


BAD = {
    "obs_type": (
        "smell",
        f"Unknown obs_type 'smell'; choose {', '.join(OBS_TYPES)}.",
    ),
    "cameras": (("back",), "Unknown camera 'back'; choose left, cup, front, top."),
    "render_mode": ("ansi", "Unknown render_mode 'ansi'; choose None, rgb_array, rgb_array_list."),
    "quality": ("great", "Unknown quality 'great'; choose fast, nice."),
    "width": (0, "The width is 0 pixels; choose from 1 to 4096."),
    "height": (5000, "The height is 5000 pixels; choose from 1 to 4096."),
    "max_actions": (0, "max_actions is 0; choose 1 or more."),
    "control": ("torque", "Unknown control 'torque'; choose position, delta."),
    "reward_weights": (
        {"speed": 1.0},
        "Unknown reward term 'speed'; choose subtasks, success, spill, collision, unsafe.",
    ),
}
OF_ONE = {"max_actions": "TeaMakingSubtasks", "control": "TeaMaking", "reward_weights": "TeaMaking"}


@pytest.mark.parametrize(
    ("name", "key"), [(name, key) for key in BAD for name in NAMES if OF_ONE.get(key, name) == name]
)
@pytest.mark.filterwarnings("ignore::UserWarning")  # Gymnasium's own words about render modes
def test_a_bad_argument_is_named_with_the_choices(make, name, key):
    value, sentence = BAD[key]
    with pytest.raises(ConfigError) as error:
        make(name, **(VIEWS["pixels"] | {key: value}))
    assert str(error.value) == sentence


@each_env
@pytest.mark.parametrize("cameras", [(), ("cup", "cup")])
def test_every_camera_is_named_once(make, name, cameras):
    sentence = "Name each camera once, at least one of left, cup, front, top."
    with pytest.raises(ConfigError) as error:
        make(name, obs_type="pixels", cameras=cameras)
    assert str(error.value) == sentence


@each_env
def test_every_violation_has_words_and_a_kind(make, name):
    metadata = make(name).metadata
    words, kinds = metadata["violations"], metadata["violation_kinds"]
    assert words["unsafe"] == "oven left on"
    assert words["spilled_water"] == "water spilled"
    assert words["add_water_before_turn_off_oven"] == "add_water before turn_off_oven"
    assert sorted(key for keys in kinds.values() for key in keys) == sorted(words)
    assert list(kinds) == ["oven left on", "spilled", "out of order"]
    breaks = judge(SUBTASKS[::-1], oven_on=True, spilled={"sugar": 9.0}).violations
    assert breaks
    assert set(breaks) <= set(words)
