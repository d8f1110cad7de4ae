"""Policies of other people's code, named MODULE:NAME: any object with the method `predict`.

The calling convention is that of stable-baselines3 (`policies.data.samples.Policy`). What else a
policy says of itself is optional: `level`, `spec`, `draws` and `set_random_seed`.
"""

import importlib
import os
import re
import sys
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from policies.data.samples import Observation, ObservationSpec, RecurrentState
from policies.learners.motion_policy import JointPolicy
from policies.play.environments import make_environment
from policies.settings import EnvironmentConfig
from teasim.common.errors import ConfigError

NAME = re.compile(r"(?P<module>\w+(?:\.\w+)*):(?P<attribute>\w+)")
"""Name of a policy in code."""
LEVELS = ("subtask", "joint")
"""What a policy may choose: the next sub-task, or joint targets."""
NOTHING_SEEN = ObservationSpec((), 0, 0)
"""Stands for the state of an environment until the environment has said what it shows."""


def is_named(run: Path) -> bool:
    """Whether `run` is the name of a policy in code, not a folder."""
    return NAME.fullmatch(str(run)) is not None and not run.exists()


class Named:
    """An object by its name; in another process it is made anew."""

    def __init__(self, name: str, folder: str) -> None:
        """Find the object `name`, importable from `folder` too, and call it if it is a class.

        Raises:
            ConfigError: there is no such object, or it has no method `predict`.
        """
        self.name, self.folder = name, folder
        self.held = find_object(name, folder)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.name, self.folder)


class ForeignPolicy:
    """A policy over sub-tasks that somebody else wrote."""

    def __init__(self, named: Named, spec: ObservationSpec, action_names: tuple[str, ...]) -> None:
        """Make a policy of an object; what it sees and chooses from is that of an environment."""
        self._named = named
        self.draws = bool(getattr(named.held, "draws", True))
        self.spec = spec
        self.action_names = action_names

    def set_random_seed(self, seed: int) -> None:
        """Restart the random numbers, if the policy can."""
        if hasattr(self._named.held, "set_random_seed"):
            self._named.held.set_random_seed(seed)

    def predict(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[Any], RecurrentState | None]:
        """Ask the policy for one observation.

        Raises:
            ConfigError: the answer is not an action and a state, or there is no such action.
        """
        answer = self._named.held.predict(observation, state, episode_start, deterministic)
        if not isinstance(answer, tuple) or len(answer) != 2:
            raise ConfigError(
                f"predict of '{self._named.name}' returned {answer!r}; return (action, state)."
            )
        return self._checked(np.asarray(answer[0])), answer[1]

    def _checked(self, action: NDArray[Any]) -> NDArray[Any]:
        """Return `action` as one number that is a sub-task's."""
        if action.size != 1 or action.item() not in range(len(self.action_names)):
            raise ConfigError(
                f"predict of '{self._named.name}' chose {action.tolist()}; choose a number "
                f"from 0 to {len(self.action_names) - 1}."
            )
        return action.reshape(()).astype(np.int64)


class ForeignJointPolicy(ForeignPolicy, JointPolicy):
    """A policy over joint targets that somebody else wrote."""

    def _checked(self, action: NDArray[Any]) -> NDArray[Any]:
        """Return `action` as one target [rad; m for grippers] per joint and gripper."""
        if action.size != len(self.action_names):
            raise ConfigError(
                f"predict of '{self._named.name}' returned {action.size} targets; return "
                f"{len(self.action_names)}."
            )
        return action.reshape(-1).astype(np.float32)


def adopt(name: str, environment: EnvironmentConfig) -> ForeignPolicy:
    """Return the policy `name` as one for `environment`, whose actions and state it takes over.

    Raises:
        ConfigError: there is no such object, it is no policy, or the environment cannot be made.
    """
    named = Named(name, os.getcwd())
    level = getattr(named.held, "level", LEVELS[0])
    if level not in LEVELS:
        raise ConfigError(f"Unknown level '{level}' of '{name}'; choose {', '.join(LEVELS)}.")
    env = make_environment(environment.at_level(level), NOTHING_SEEN)
    with closing(env):
        observation, info = env.reset(seed=0)
        joints = _numbered("joint", np.size(observation.get("agent_pos", ())))
        station = _numbered("state", np.size(observation.get("environment_state", ())))
        controlled = _numbered("target", int(np.prod(env.action_space.shape or ())))
    spec = getattr(named.held, "spec", None) or ObservationSpec((), 0, 0, joints, station)
    if level == "joint":
        return ForeignJointPolicy(named, spec, controlled)
    return ForeignPolicy(named, spec, tuple(info["subtasks"]))


def find_object(name: str, folder: str) -> Any:
    """Return the policy `name`; what has no `predict` and classes are called without arguments.

    Raises:
        ConfigError: there is no such module or attribute, or it has no method `predict`.
    """
    parts = NAME.fullmatch(name)
    if parts is None:
        raise ConfigError(f"'{name}' names no policy; write MODULE:NAME.")
    if folder not in sys.path:
        sys.path.insert(0, folder)
    module = parts["module"]
    try:
        found = importlib.import_module(module)
    except ModuleNotFoundError as error:
        if not f"{module}.".startswith(f"{error.name}."):
            raise  # the module is there, and something it imports is not
        raise ConfigError(
            f"There is no module '{module}' for the policy '{name}'; start in its folder, or "
            "install it."
        ) from error
    if not hasattr(found, parts["attribute"]):
        able = [key for key, value in vars(found).items() if hasattr(value, "predict")]
        raise ConfigError(
            f"The module '{module}' has no '{parts['attribute']}'; "
            f"what has a method predict there: {', '.join(able) or 'nothing'}."
        )
    held = getattr(found, parts["attribute"])
    if isinstance(held, type) or (callable(held) and not hasattr(held, "predict")):
        held = held()
    if not callable(getattr(held, "predict", None)):
        raise ConfigError(
            f"'{name}' has no method predict(observation, state, episode_start, deterministic)."
        )
    return held


def _numbered(word: str, count: int) -> tuple[str, ...]:
    return tuple(f"{word}_{n}" for n in range(count))
