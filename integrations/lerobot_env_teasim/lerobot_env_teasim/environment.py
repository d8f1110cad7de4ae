"""`TeaMaking-v0` with the actions and observations that a pool logs; LeRobot is not needed."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from teasim.envs.joint_env import TeaMakingEnv
from teasim.pool.types import EpisodeRecord

NAMESPACE = "lerobot_env_teasim"
"""Namespace of the environment in Gymnasium's registry; importing a module of this name fills it,
which is how LeRobot looks for an environment that it does not find."""
TASK = "TeaMaking-v0"
"""Name of the environment in its namespace."""


class AsLogged(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Takes the actions and shows the observations that a policy trained on a pool knows.

    An action is the target of every joint [rad] and gripper [m], (16,), as `action` in a pool, in
    place of shares of their ranges. The pictures are a dict by camera even if there is one camera,
    so that LeRobot names them `observation.images.CAMERA`.
    """

    task = TASK
    """Short name of the task, which LeRobot passes to a policy without a description."""
    task_description = EpisodeRecord.task
    """The task in words, as in a pool; policies that read language are given it."""

    def __init__(self, env: TeaMakingEnv, camera: str) -> None:
        """Wrap `env`; `camera` is the name of its pictures if it has a single camera."""
        super().__init__(env)
        self._tea: TeaMakingEnv = env
        self._camera = camera
        shares = np.ones(env.action_space.shape or ())
        low, high = env.target(-shares), env.target(shares)
        self.action_space = spaces.Box(low.astype(np.float32), high.astype(np.float32))
        shown = dict(env.observation_space.spaces)  # type: ignore[attr-defined]
        if isinstance(shown.get("pixels"), spaces.Box):
            shown["pixels"] = spaces.Dict({camera: shown["pixels"]})
        self.observation_space = spaces.Dict(shown)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Start a new episode."""
        observation, info = self._tea.reset(seed=seed, options=options)
        return self._named(observation), info

    def step(self, action: Any) -> tuple[dict[str, Any], float, bool, bool, dict[str, Any]]:
        """Advance 0.1 s towards the targets `action` (16,); those out of reach are clipped.

        Raises:
            ConfigError: the action is not one finite number per joint and gripper.
        """
        share = self._tea.action(np.asarray(action, dtype=np.float64))
        observation, *outcome = self._tea.step(share)
        return (self._named(observation), *outcome)  # type: ignore[return-value]

    def _named(self, observation: dict[str, Any]) -> dict[str, Any]:
        """Return `observation` with a name for a single picture."""
        pixels = observation.get("pixels")
        if isinstance(pixels, np.ndarray):
            return observation | {"pixels": {self._camera: pixels}}
        return observation


def make(**kwargs: Any) -> AsLogged:
    """Make the environment; `kwargs` are the arguments of `teasim.envs.base.StationEnv`."""
    env = TeaMakingEnv(control="position", **kwargs)
    return AsLogged(env, next(iter(kwargs.get("cameras", ())), ""))


def register_environment() -> None:
    """Register the environment with Gymnasium; doing it twice changes nothing."""
    name = f"{NAMESPACE}/{TASK}"
    if name not in gymnasium.registry:
        gymnasium.register(name, entry_point=make)
