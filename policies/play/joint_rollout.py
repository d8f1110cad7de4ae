"""One episode of a joint-level policy: targets at 10 Hz until tea is made or nothing happens."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from policies.learners.motion_policy import MotionPolicy
from teasim.common.errors import CheckpointError

JOINT_ENVIRONMENT = "teasim:teasim/TeaMaking-v0"

PATIENCE = 300
"""Control steps (0.1 s) without a new sub-task after which an episode is over; in demonstrations
none takes half as long."""


@dataclass(frozen=True)
class MotionEpisode:
    """What a joint-level policy did in one episode."""

    seed: int
    """Seed of the environment and of sampled decisions."""
    steps: int
    """Control steps (0.1 s)."""
    subtasks: tuple[str, ...]
    """Sub-tasks there are."""
    success: bool
    """The goal was reached."""
    unsafe: bool
    """The oven is on at the end."""
    subtasks_done: tuple[str, ...]
    """Sub-tasks that took effect, as physics shows, in order."""
    violations: tuple[str, ...]
    """Rules that were broken."""

    @property
    def last(self) -> str:
        """The last sub-task that took effect, `none` without any."""
        return self.subtasks_done[-1] if self.subtasks_done else "none"


def run_motion(
    env: gym.Env[Any, Any], policy: MotionPolicy, seed: int, *, deterministic: bool
) -> MotionEpisode:
    """Run `policy` until the goal is reached, the time is up, or nothing happens for `PATIENCE`.

    The environment says which action means a target: `env.unwrapped.action(target)`.

    Raises:
        CheckpointError: the policy was trained for another state or other joints than `env` has.
    """
    policy.set_random_seed(seed)
    observation, info = env.reset(seed=seed)
    check_joints(env, policy, observation)
    as_action: Any = env.unwrapped.action  # type: ignore[attr-defined]
    state, start, done = None, np.ones(1, dtype=np.bool_), False
    steps = idle = 0
    while not done and idle < PATIENCE:
        target, state = policy.predict(observation, state, start, deterministic)
        before = len(info["subtasks_done"])
        observation, _, terminated, truncated, info = env.step(as_action(target))
        steps += 1
        idle = idle + 1 if len(info["subtasks_done"]) == before else 0
        start, done = np.zeros(1, dtype=np.bool_), terminated or truncated
    return MotionEpisode(
        seed,
        steps,
        tuple(info["subtasks"]),
        bool(info["success"]),
        bool(info["unsafe"]),
        tuple(info["subtasks_done"]),
        tuple(info["violations"]),
    )


def check_joints(
    env: gym.Env[Any, Any], policy: MotionPolicy, observation: Mapping[str, Any]
) -> None:
    """Raise CheckpointError unless `policy` was trained for the environment at hand."""
    controlled = env.action_space.shape
    if controlled != (len(policy.action_names),) or not hasattr(env.unwrapped, "action"):
        raise CheckpointError(
            f"The policy controls {len(policy.action_names)} joints, but the environment's actions "
            f"are {env.action_space}."
        )
    seen = sum(np.size(observation.get(key, ())) for key in ("agent_pos", "environment_state"))
    if seen != policy.spec.low_dim:
        raise CheckpointError(
            f"The policy sees {policy.spec.low_dim} numbers of the state, but the environment "
            f"shows {seen}."
        )
