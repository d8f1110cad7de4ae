"""Environments in which policies are evaluated, and what an environment reports of an episode."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from typing import Any

import gymnasium as gym

from policies.data.samples import ObservationSpec
from policies.play.remembering import Remembering, can_remember
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

    `filmed` adds rendering for a policy without cameras; a policy with cameras needs none. Further
    `settings` are passed on to the environment.

    Raises:
        ConfigError: there is no such environment, or it does not take the settings.
    """
    sight: dict[str, Any] = {"obs_type": "state"}
    if spec.cameras:
        size = {"width": spec.width, "height": spec.height}
        sight = {"obs_type": "pixels_agent_pos", "cameras": spec.cameras, **size}
    elif filmed:
        sight["render_mode"] = "rgb_array"
    if len(sight) > 1:
        sight["quality"] = config.quality  # of pictures, which some environments do not have
        if config.look != "fixed":
            sight["look"] = config.look
    if config.max_actions is not None:
        sight["max_actions"] = config.max_actions
    env_id = config.env_id or SUBTASK_ENVIRONMENT
    try:
        return gym.make(env_id, randomize=config.randomize, **sight, **settings)
    except (gym.error.Error, TypeError, ImportError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"Cannot make the environment '{env_id}': {reason}") from error


@contextmanager
def worlds(config: EnvironmentConfig, *, filmed: bool = False) -> Iterator[World]:
    """Provide environments by observation spec; policies with equal specs share one.

    An environment that is filmed simulates everything, also what has been simulated before.
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
