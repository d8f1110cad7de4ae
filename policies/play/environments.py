"""Environments in which policies are evaluated, and what an environment reports of an episode."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from importlib import import_module
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import load_env_creator

from policies.data.samples import ObservationSpec
from policies.play.remembering import Remembering, can_remember
from policies.play.video import FILM
from policies.settings import SUBTASK_ENVIRONMENT, EnvironmentConfig
from teasim.common.errors import ConfigError

UNSAFE = "unsafe"
"""Key under which an episode that ends in an unsafe state (`info["unsafe"]`) is a violation."""

World = Callable[[ObservationSpec], gym.Env[Any, Any]]
"""Returns the environment for policies with an observation spec."""


def make_environment(
    config: EnvironmentConfig, spec: ObservationSpec, *, filmed: bool = False, **settings: Any
) -> gym.Env[Any, Any]:
    """Make the environment with the observations that a policy of `spec` needs.

    `filmed` is for videos: the environment shows its motion if it can; otherwise rendering is added
    for a policy without cameras. Further `settings` are passed on to the environment.

    Raises:
        ConfigError: there is no such environment, or it does not take the settings.
    """
    sight: dict[str, Any] = {"obs_type": "state"}
    if spec.cameras:
        size = {"width": spec.width, "height": spec.height}
        sight = {"obs_type": "pixels_agent_pos", "cameras": spec.cameras, **size}
    env_id = config.env_id or SUBTASK_ENVIRONMENT
    if filmed and (FILM in render_modes(env_id) or not spec.cameras):
        sight["render_mode"] = FILM if FILM in render_modes(env_id) else "rgb_array"
    if len(sight) > 1:
        sight["quality"] = config.quality  # of pictures, which some environments do not have
        if config.look != "fixed":
            sight["look"] = config.look
    if config.max_actions is not None:
        sight["max_actions"] = config.max_actions
    try:
        return gym.make(env_id, randomize=config.randomize, **sight, **settings)
    except (gym.error.Error, TypeError, ImportError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"Cannot make the environment '{env_id}': {reason}") from error


def render_modes(env_id: str) -> Sequence[str]:
    """Return the render modes that an environment names; none if they are not known before."""
    module, _, name = env_id.rpartition(":")
    try:
        if module:
            import_module(module)  # registers its environments
        entry = gym.spec(name).entry_point
        made: Any = load_env_creator(entry) if isinstance(entry, str) else entry
    except (gym.error.Error, ImportError, AttributeError):
        return ()  # making the environment tells why
    return tuple(getattr(made, "metadata", {}).get("render_modes", ()))


@contextmanager
def worlds(config: EnvironmentConfig, *, filmed: bool = False) -> Iterator[World]:
    """Provide environments by observation spec; policies with equal specs share one.

    What is `filmed` is simulated anew, because a remembered decision shows no motion.
    """
    with ExitStack() as stack:
        made: dict[ObservationSpec, gym.Env[Any, Any]] = {}

        def world(spec: ObservationSpec) -> gym.Env[Any, Any]:
            if spec not in made:
                env = stack.enter_context(closing(make_environment(config, spec, filmed=filmed)))
                made[spec] = Remembering(env) if can_remember(env) and not filmed else env
            return made[spec]

        yield world


def violation_words(env: gym.Env[Any, Any]) -> Mapping[str, str]:
    """Words for the violations that `env` can report: key of `info["violations"]` -> words.

    Keys with the same words are one kind of violation and are counted together. The metadata of an
    environment name them: `violation_kinds` (words -> keys that are counted together), or
    `violations` (key -> words). For an environment that names none the mapping is empty.
    """
    metadata = env.unwrapped.metadata
    if "violation_kinds" in metadata:
        return {key: words for words, keys in metadata["violation_kinds"].items() for key in keys}
    return dict(metadata.get("violations", {}))


def reported(env: gym.Env[Any, Any], seed: int, info: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of `outcomes.Played` for an episode that ended with `info`."""
    words = violation_words(env)
    keys = tuple(info["violations"])
    if info.get("unsafe") and UNSAFE not in keys:
        keys = (UNSAFE, *keys)
    occurred = {words.get(key, key.replace("_", " ")) for key in keys}
    kinds = dict.fromkeys(words.values(), False) | dict.fromkeys(sorted(occurred), True)
    return {
        "seed": seed,
        "success": bool(info["success"]),
        "subtasks_done": tuple(info["subtasks_done"]),
        "violations": keys,
        "kinds": kinds,
    }
