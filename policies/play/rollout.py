"""One episode of a policy in the sub-task environment, decision by decision."""

from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from policies.data.samples import Observation, Policy
from policies.play.environments import reported
from policies.play.outcomes import Played
from policies.play.video import Film
from teasim.common.errors import CheckpointError


@dataclass(frozen=True)
class Action:
    """One executed action, judged by the state before it."""

    name: str
    """Chosen sub-task."""
    reference: str | None
    """Next sub-task of the reference (Seq_1), None if none is left."""
    correct: bool
    """Whether it is the reference's."""
    allowed: bool
    """Whether the precedence of the sub-tasks allows it."""


@dataclass(frozen=True, kw_only=True)
class Episode(Played):
    """One episode of a policy over sub-tasks."""

    actions: tuple[Action, ...]
    """Executed actions in order."""

    @property
    def n_correct(self) -> int:
        """Number of executed actions that are the reference's."""
        return sum(action.correct for action in self.actions)


def run_episode(
    env: gym.Env[Any, Any],
    policy: Policy,
    seed: int,
    *,
    deterministic: bool,
    video: Path | None = None,
) -> Episode:
    """Run `policy` until the episode ends; `video` is an mp4 file to write.

    Raises:
        CheckpointError: the policy was trained for other sub-tasks or another state than `env` has.
    """
    policy.set_random_seed(seed)
    observation, info = env.reset(seed=seed)
    check_fit(policy, observation, info)
    actions: list[Action] = []
    state, start, done = None, np.ones(1, dtype=np.bool_), False
    with nullcontext() if video is None else Film(video, env, policy) as film:
        while not done:
            choice, state = policy.predict(observation, state, start, deterministic)
            actions.append(_judge(int(choice), info))
            if film is not None:
                film.before(observation, actions[-1].name)
            observation, _, terminated, truncated, info = env.step(int(choice))
            if film is not None:
                film.after()
            start, done = np.zeros(1, dtype=np.bool_), terminated or truncated
        if film is not None:
            film.end(observation, bool(info["success"]))
    return Episode(**reported(env, seed, info), actions=tuple(actions))


def check_fit(policy: Policy, observation: Observation, info: Mapping[str, Any]) -> None:
    """Raise CheckpointError unless `policy` was trained for this environment."""
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
