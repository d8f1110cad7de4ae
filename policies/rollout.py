"""One episode of a policy in the sub-task environment, decision by decision."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from policies.base import Observation, ObservationSpec, Policy, pictures
from teasim.errors import CheckpointError, ConfigError
from teasim.pool.videos import VideoWriter

ENVIRONMENT = "teasim:teasim/TeaMakingSubtasks-v0"


@dataclass(frozen=True)
class EnvironmentConfig:
    """Which world the policy is put into."""

    env_id: str = ENVIRONMENT
    """Gymnasium id; anything that keeps the observations and info of TeaMakingSubtasks-v0."""
    quality: str = "fast"
    """Rendering quality, fast or nice; should be that of the pool."""
    randomize: bool = True
    """Move and turn the things on the table from episode to episode."""
    max_actions: int = 14
    """Actions after which an episode is cut off."""


@dataclass(frozen=True)
class Action:
    """One executed action, judged by what was true before it."""

    name: str
    """Sub-task that was chosen."""
    reference: str | None
    """Sub-task that Seq_1 has next, None when it has none left."""
    correct: bool
    """It is the reference's."""
    allowed: bool
    """The precedence of the sub-tasks allows it."""


@dataclass(frozen=True)
class Episode:
    """What a policy did in one episode."""

    seed: int
    """Seed of the environment and of sampled decisions."""
    actions: tuple[Action, ...]
    """Executed actions in order."""
    success: bool
    """The goal was reached."""
    unsafe: bool
    """The oven is on at the end."""
    subtasks_done: tuple[str, ...]
    """Sub-tasks that took effect, in order."""
    violations: tuple[str, ...]
    """Rules that were broken."""


def make_environment(config: EnvironmentConfig, spec: ObservationSpec) -> gym.Env[Any, Any]:
    """Make the environment with the observations a policy of `spec` needs.

    Raises:
        ConfigError: there is no such environment, or it does not take the settings.
    """
    try:
        return gym.make(
            config.env_id,
            obs_type="pixels_agent_pos",
            cameras=spec.cameras,
            width=spec.width,
            height=spec.height,
            quality=config.quality,
            randomize=config.randomize,
            max_actions=config.max_actions,
        )
    except (gym.error.Error, TypeError, ImportError) as error:
        reason = " ".join(str(error).split())
        raise ConfigError(f"Cannot make the environment '{config.env_id}': {reason}") from error


def run_episode(
    env: gym.Env[Any, Any],
    policy: Policy,
    seed: int,
    *,
    deterministic: bool,
    video: Path | None = None,
) -> Episode:
    """Run `policy` until the episode ends; `video` gets what it saw, one frame per decision.

    Raises:
        CheckpointError: the policy was trained for other sub-tasks or joints than `env` has.
    """
    policy.set_random_seed(seed)
    observation, info = env.reset(seed=seed)
    check_fit(policy, observation, info)
    actions, frames, state = [], [_picture(observation, policy)], None
    start, done = np.ones(1, dtype=np.bool_), False
    while not done:
        choice, state = policy.predict(observation, state, start, deterministic)
        actions.append(_judge(int(choice), info))
        observation, _, terminated, truncated, info = env.step(int(choice))
        frames.append(_picture(observation, policy))
        start, done = np.zeros(1, dtype=np.bool_), terminated or truncated
    if video is not None:
        _write_video(video, frames)
    return Episode(
        seed,
        tuple(actions),
        bool(info["success"]),
        bool(info["unsafe"]),
        tuple(info["subtasks_done"]),
        tuple(info["violations"]),
    )


def check_fit(policy: Policy, observation: Observation, info: Mapping[str, Any]) -> None:
    """Raise CheckpointError unless `policy` was trained for the environment at hand."""
    names = tuple(info["subtasks"])
    if names != policy.action_names:
        raise CheckpointError(
            f"The policy chooses from {', '.join(policy.action_names)}, "
            f"but the environment's sub-tasks are {', '.join(names)}."
        )
    joints = np.shape(observation["agent_pos"])
    if policy.spec.state_names and joints != (len(policy.spec.state_names),):
        raise CheckpointError(
            f"The policy sees {len(policy.spec.state_names)} joint positions, "
            f"but the environment shows {joints[0]}."
        )


def _judge(choice: int, info: Mapping[str, Any]) -> Action:
    names = info["subtasks"]
    reference = int(info["correct_action"])
    return Action(
        name=names[choice],
        reference=names[reference] if reference >= 0 else None,
        correct=choice == reference,
        allowed=choice in info["allowed_actions"],
    )


def _picture(observation: Observation, policy: Policy) -> NDArray[np.uint8]:
    """All cameras side by side, (H, cameras * W, 3)."""
    return np.hstack(list(pictures(observation, policy.spec.cameras).values()))


def _write_video(path: Path, frames: list[NDArray[np.uint8]]) -> None:
    """Write `frames` (H, W, 3) at one decision per second."""
    path.parent.mkdir(parents=True, exist_ok=True)
    height, width, _ = frames[0].shape
    video = VideoWriter(path, height=height, width=width, fps=1)
    for frame in frames:
        video.add(frame)
    video.close()
