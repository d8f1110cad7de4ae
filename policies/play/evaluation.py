"""Scores of a policy over sub-tasks: policy accuracy (the paper, section 4.3), success, violations.

Each episode is run twice: with the most probable sub-task at every decision, and with a sampled
one. The first can outvote a minority of incorrect demonstrations, the second shows what was learned
from them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium as gym

from filtering.vision.determinism import one_thread
from policies.data.samples import Policy
from policies.play.environments import worlds
from policies.play.outcomes import Outcomes, tally
from policies.play.rollout import Episode, run_episode
from policies.settings import EvaluationConfig
from teasim.common import parallel
from teasim.common.statistics import Rate, grouped_rate
from teasim.common.workers import IN_PROCESS, Workers

MODES = ("deterministic", "sampled")
"""How decisions are made: the most probable sub-task, or one drawn from the probabilities."""

EPISODES_PER_BATCH = 4
"""Episodes that share one environment: few enough to keep all workers busy until the end."""


@dataclass(frozen=True)
class Scores(Outcomes):
    """Scores of one mode; all rates with 95 % intervals."""

    episodes: tuple[Episode, ...]
    """The episodes, in the order of their seeds."""
    policy_accuracy: Rate
    """Share of executed actions that are the reference's (Seq_1) next sub-task (strict)."""
    lenient_accuracy: Rate
    """Share of executed actions that the precedence of the sub-tasks allows."""


@dataclass(frozen=True)
class SubtaskBatch:
    """Scenes that one worker runs one after the other."""

    policies: tuple[Policy, ...]
    """Policies that act in every scene."""
    seeds: tuple[int, ...]
    """Seeds of the scenes."""
    config: EvaluationConfig
    """Settings of the evaluation."""


def evaluate(
    policy: Policy, config: EvaluationConfig, *, workers: Workers = IN_PROCESS
) -> dict[str, Scores]:
    """Score `policy` in both modes; the result does not depend on `workers`.

    Raises:
        CheckpointError: the policy was trained for another environment.
        ConfigError: the environment cannot be made.
    """
    return evaluate_all([policy], config, workers=workers)[0]


def evaluate_all(
    policies: Sequence[Policy], config: EvaluationConfig, *, workers: Workers = IN_PROCESS
) -> list[dict[str, Scores]]:
    """Score all `policies` in the same scenes; decisions they share are simulated once.

    Each gets the scores that `evaluate` gives it alone. Only the first is filmed.

    Raises:
        CheckpointError: a policy was trained for another environment.
        ConfigError: the environment cannot be made.
    """
    work = [
        SubtaskBatch(tuple(policies), seeds, config)
        for seeds in batches(range(config.seed, config.seed + config.episodes))
    ]
    parts = parallel.run(_play_batch, work, workers=workers, description="episodes")
    return [
        {
            mode: score(mode, [e for part in parts for e in part[n][mode]], policy.action_names)
            for mode in MODES
        }
        for n, policy in enumerate(policies)
    ]


@dataclass(frozen=True)
class Studio:
    """Where deterministic episodes are filmed."""

    env: gym.Env[Any, Any]
    """Environment that shows its motion, if it can."""
    folder: Path
    """Folder of the videos."""


def play(
    env: gym.Env[Any, Any], policy: Policy, seeds: Sequence[int], studio: Studio | None = None
) -> dict[str, list[Episode]]:
    """Run the scenes `seeds` in both modes; the deterministic ones in the `studio`, if any."""
    with one_thread():
        return {mode: [_run(env, policy, seed, mode, studio) for seed in seeds] for mode in MODES}


def _run(
    env: gym.Env[Any, Any], policy: Policy, seed: int, mode: str, studio: Studio | None
) -> Episode:
    sure = mode == "deterministic"
    if studio is None or not sure:
        return run_episode(env, policy, seed, deterministic=sure)
    video = studio.folder / f"episode_{seed}.mp4"
    return run_episode(studio.env, policy, seed, deterministic=sure, video=video)


def _play_batch(batch: SubtaskBatch) -> list[dict[str, list[Episode]]]:
    """Run `batch` in environments made in this worker."""
    config, film = batch.config.environment, batch.config.video
    first, *others = batch.policies
    with worlds(config) as world, worlds(config, filmed=True) as filmed:
        studio = None if film is None else Studio(filmed(first.spec), film)
        played = [play(world(first.spec), first, batch.seeds, studio)]
        return played + [play(world(policy.spec), policy, batch.seeds) for policy in others]


def score(mode: str, episodes: Sequence[Episode], subtasks: Sequence[str]) -> Scores:
    """Score `episodes` that were run in one mode."""
    allowed = [(sum(a.allowed for a in e.actions), len(e.actions)) for e in episodes]
    return Scores(
        **tally(mode, episodes, subtasks),
        episodes=tuple(episodes),
        policy_accuracy=grouped_rate([(e.n_correct, len(e.actions)) for e in episodes]),
        lenient_accuracy=grouped_rate(allowed),
    )


def batches(seeds: Sequence[int]) -> list[tuple[int, ...]]:
    """Divide `seeds` into batches for the workers."""
    size = EPISODES_PER_BATCH
    return [tuple(seeds[first : first + size]) for first in range(0, len(seeds), size)]
