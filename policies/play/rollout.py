"""One episode of a policy in the sub-task environment, decision by decision."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from policies.data.samples import Observation, ObservationSpec, Policy, pictures
from policies.play.captions import caption
from teasim.common.errors import CheckpointError, ConfigError
from teasim.pool.clips import VideoWriter

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
    max_actions: int | None = 14
    """Actions after which an episode is cut off; None: the environment has no such setting."""


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

    @property
    def n_correct(self) -> int:
        """How many of the executed actions are the reference's."""
        return sum(action.correct for action in self.actions)


def make_environment(
    config: EnvironmentConfig, spec: ObservationSpec, *, filmed: bool = False
) -> gym.Env[Any, Any]:
    """Make the environment with the observations a policy of `spec` needs.

    `filmed` lets a policy without cameras be watched; one with cameras always can.

    Raises:
        ConfigError: there is no such environment, or it does not take the settings.
    """
    sight: dict[str, Any] = {"obs_type": "state"}
    if spec.cameras:
        size = {"width": spec.width, "height": spec.height}
        sight = {"obs_type": "pixels_agent_pos", "cameras": spec.cameras, **size}
    elif filmed:
        sight["render_mode"] = "rgb_array"
    if config.max_actions is not None:
        sight["max_actions"] = config.max_actions
    try:
        return gym.make(
            config.env_id,
            quality=config.quality,
            randomize=config.randomize,
            **sight,
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
    """Run `policy` until the episode ends; `video` gets a captioned frame per decision.

    Raises:
        CheckpointError: the policy was trained for other sub-tasks or another state than `env` has.
    """
    policy.set_random_seed(seed)
    observation, info = env.reset(seed=seed)
    check_fit(policy, observation, info)
    actions: list[Action] = []
    frames, state = [], None
    start, done = np.ones(1, dtype=np.bool_), False
    while not done:
        if video is not None:
            frames.append(_picture(env, observation, policy))
        choice, state = policy.predict(observation, state, start, deterministic)
        actions.append(_judge(int(choice), info))
        observation, _, terminated, truncated, info = env.step(int(choice))
        start, done = np.zeros(1, dtype=np.bool_), terminated or truncated
    if video is not None:
        frames.append(_picture(env, observation, policy))
        _write_video(video, frames, [action.name for action in actions], bool(info["success"]))
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
    _check_length("joint positions", policy.spec.state_names, observation["agent_pos"])
    if policy.spec.environment_names:
        shown = observation.get("environment_state", ())
        _check_length("numbers of the environment state", policy.spec.environment_names, shown)


def _check_length(what: str, names: tuple[str, ...], shown: Any) -> None:
    if names and np.shape(shown) != (len(names),):
        raise CheckpointError(
            f"The policy sees {len(names)} {what}, but the environment shows {len(shown)}."
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


def _picture(env: gym.Env[Any, Any], observation: Observation, policy: Policy) -> Any:
    """All cameras of the policy side by side, (H, K * W, 3); the environment's own without any."""
    if not policy.spec.cameras:
        return env.render()
    return np.hstack(list(pictures(observation, policy.spec.cameras).values()))


def _write_video(
    path: Path, frames: list[NDArray[np.uint8]], chosen: list[str], success: bool
) -> None:
    """Write `frames` (H, W, 3) at one decision per second, below each what was chosen then."""
    path.parent.mkdir(parents=True, exist_ok=True)
    captions = [f"{number} {name}" for number, name in enumerate(chosen, start=1)]
    captions.append("goal reached" if success else "goal not reached")
    captioned = [caption(frame, text) for frame, text in zip(frames, captions, strict=True)]
    height, width, _ = captioned[0].shape
    video = VideoWriter(path, height=height, width=width, fps=1)
    for frame in captioned:
        video.add(frame)
    video.close()
