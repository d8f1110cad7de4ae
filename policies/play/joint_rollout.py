"""One episode of a joint-level policy: targets at 10 Hz until the goal, a time limit or a stall."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from policies.learners.motion_policy import JointPolicy
from policies.play.environments import reported
from policies.play.outcomes import Played
from teasim.common.errors import CheckpointError

PATIENCE = 300
"""Control steps (0.1 s) without a new sub-task after which an episode is over; no sub-task of a
demonstration takes half as long."""


@dataclass(frozen=True, kw_only=True)
class MotionEpisode(Played):
    """One episode of a joint-level policy."""

    steps: int
    """Control steps (0.1 s)."""
    subtasks: tuple[str, ...]
    """All sub-tasks of the environment."""

    @property
    def last(self) -> str:
        """The last sub-task that took effect, `none` if there is none."""
        return self.subtasks_done[-1] if self.subtasks_done else "none"


def run_motion(
    env: gym.Env[Any, Any], policy: JointPolicy, seed: int, *, deterministic: bool
) -> MotionEpisode:
    """Run `policy` until the goal, the time limit, or `PATIENCE` steps without a new sub-task.

    The environment turns a target into an action: `env.unwrapped.action(target)`.

    Raises:
        CheckpointError: the policy was trained for another state or other joints than `env` has.
    """
    policy.set_random_seed(seed)
    observation, info = env.reset(seed=seed)
    check_joints(env, policy, observation)
    as_action: Any = env.unwrapped.action  # type: ignore[attr-defined]
    state, start, done = None, np.ones(1, dtype=np.bool_), False
    steps = stalled = 0
    while not done and stalled < PATIENCE:
        target, state = policy.predict(observation, state, start, deterministic)
        before = len(info["subtasks_done"])
        observation, _, terminated, truncated, info = env.step(as_action(target))
        steps += 1
        stalled = stalled + 1 if len(info["subtasks_done"]) == before else 0
        start, done = np.zeros(1, dtype=np.bool_), terminated or truncated
    subtasks = tuple(info["subtasks"])
    return MotionEpisode(**reported(env, seed, info), steps=steps, subtasks=subtasks)


def check_joints(
    env: gym.Env[Any, Any], policy: JointPolicy, observation: Mapping[str, Any]
) -> None:
    """Raise CheckpointError unless `policy` was trained for this environment."""
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
