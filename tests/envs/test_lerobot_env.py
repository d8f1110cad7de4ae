"""LeRobot's commands find the tea station, and what it shows is named as in a pool."""

import re
import sys
import tomllib
from pathlib import Path

import gymnasium
import numpy as np
import pytest

from teasim.constants import CAMERAS, FPS
from teasim.envs.observations import OBS_TYPES
from teasim.generation import GenerateConfig
from teasim.generation.recording import pool_header
from teasim.pool.types import EpisodeRecord
from tests.envs import fake_lerobot
from tests.envs.test_replay import SEED, log
from tests.envs.test_replay import SUBTASKS as DONE

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "integrations/lerobot_env_teasim"
NAME = "lerobot_env_teasim"
SMALL = {"observation_height": 24, "observation_width": 32}

__all__ = ["log"]  # a fixture


@pytest.fixture
def plugin(monkeypatch):
    """The package as LeRobot imports it, by the name of its distribution."""
    for name, module in fake_lerobot.modules().items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(fake_lerobot.EnvConfig, "choices", {})
    monkeypatch.syspath_prepend(str(FOLDER))
    fake_lerobot.forget(NAME)
    yield __import__(NAME)
    fake_lerobot.forget(NAME)
    gymnasium.registry.pop(f"{NAME}/TeaMaking-v0", None)


@pytest.fixture
def build(plugin):
    made = []

    def build(**settings):
        """The configuration and the environment that LeRobot makes of it."""
        config = fake_lerobot.EnvConfig.choices["teasim"](**(SMALL | settings))
        env = gymnasium.make(config.gym_id, disable_env_checker=True, **config.gym_kwargs)
        made.append(env)
        return config, env

    yield build
    for env in made:
        env.close()


def in_data_set(observation: dict) -> dict[str, tuple[int, ...]]:
    """Shapes by the names that LeRobot gives the parts of an observation."""
    names = {"agent_pos": "observation.state"}
    shapes = {
        names.get(key, f"observation.{key}"): part.shape
        for key, part in observation.items()
        if key != "pixels"
    }
    pictures = observation.get("pixels", {})
    return shapes | {f"observation.images.{key}": part.shape for key, part in pictures.items()}


def test_the_distribution_has_the_name_of_the_package_with_the_prefix_lerobot_looks_for():
    project = tomllib.loads((FOLDER / "pyproject.toml").read_text())["project"]
    assert project["name"] == NAME
    assert NAME.startswith("lerobot_env_")
    assert (FOLDER / NAME / "__init__.py").is_file()
    assert any(re.match(r"lerobot\b", line) for line in project["dependencies"])


@pytest.mark.parametrize("obs_type", OBS_TYPES)
@pytest.mark.parametrize("cameras", [["cup"], ["cup", "left"]])
def test_the_declared_features_are_what_is_seen(build, obs_type, cameras):
    config, env = build(obs_type=obs_type, cameras=cameras)
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    declared = {
        config.features_map[key]: feature.shape
        for key, feature in config.features.items()
        if key != "action"
    }
    assert in_data_set(observation) == declared
    assert config.features["action"].shape == env.action_space.shape


def test_a_policy_of_a_pool_finds_all_its_features_by_name(build):
    config, env = build()
    header = pool_header(GenerateConfig())
    assert set(config.features_map.values()) == {
        "action",
        "observation.state",
        "observation.environment_state",
        *(f"observation.images.{camera}" for camera in header.cameras),
    }
    assert config.features["agent_pos"].shape == (len(header.state_names),)
    assert config.features["environment_state"].shape == (len(header.environment_state_names),)
    assert config.fps == env.metadata["render_fps"] == header.fps == FPS
    assert env.get_wrapper_attr("task_description") == EpisodeRecord.task
    assert set(config.cameras) < set(CAMERAS)


def test_features_of_a_stored_configuration_are_replaced(plugin):
    kind = fake_lerobot.EnvConfig.choices["teasim"]
    stored, asked = kind(), kind(obs_type="state")
    again = kind(obs_type="state", features=stored.features, features_map=stored.features_map)
    assert (again.features, again.features_map) == (asked.features, asked.features_map)
    assert set(asked.features) == {"action", "agent_pos", "environment_state"}


def test_the_default_pictures_have_the_size_of_a_pools(plugin):
    config = fake_lerobot.EnvConfig.choices["teasim"]()
    header = pool_header(GenerateConfig())
    size = (header.height, header.width, 3)
    shapes = [f.shape for f in config.features.values() if f.type == "VISUAL"]
    assert shapes == [size] * len(header.cameras)


def test_the_targets_of_a_pool_are_actions(build, log):
    targets, _, (joints, station) = log
    _, env = build(obs_type="state")
    env.reset(seed=SEED)
    for target in targets:
        assert target in env.action_space
        observation, _, terminated, truncated, info = env.step(target)
    assert info["subtasks_done"] == DONE
    assert not any((terminated, truncated, info["is_success"]))
    assert observation["agent_pos"] == pytest.approx(joints, abs=1e-3)
    assert observation["environment_state"] == pytest.approx(station, abs=0.01)


def test_the_same_seed_and_targets_give_the_same_bits(build):
    seen = []
    for _ in range(2):
        _, env = build(cameras=["cup"])
        observation, _ = env.reset(seed=7)
        env.action_space.seed(7)
        after = env.step(env.action_space.sample())[0]
        seen.append([*flat(observation), *flat(after)])
    assert seen[0] == seen[1]


def flat(observation: dict) -> list[bytes]:
    pictures = [part.tobytes() for part in observation["pixels"].values()]
    return [*pictures, observation["agent_pos"].tobytes()]


def test_an_episode_is_truncated_after_its_length(build):
    _, env = build(obs_type="state", episode_length=2)
    observation, _ = env.reset(seed=0)
    ends = [env.step(observation["agent_pos"])[3] for _ in range(2)]
    assert ends == [False, True]
    assert env.get_wrapper_attr("_max_episode_steps") == 2


def test_films_can_be_made(build):
    _, env = build(obs_type="state")
    env.reset(seed=0)
    assert env.render().dtype == np.uint8
