"""Scores of a joint-level policy: how far it gets, by what physics shows.

Deterministic decisions keep to the typical style, sampled ones to one drawn for each episode. Where
nothing on the table is moved, deterministic episodes would all be the same one: it is played once.
"""

from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass

from policies.evaluation import EPISODES_PER_BATCH, MODES, SPILL, EvaluationConfig
from policies.joint.policy import MotionPolicy
from policies.joint.rollout import MotionEpisode, run_motion
from policies.networks import one_thread
from policies.rollout import EnvironmentConfig, make_environment
from policies.statistics import Rate, grouped_rate, rate
from teasim import parallel


@dataclass(frozen=True)
class MotionScores:
    """What the episodes of one mode come to; all rates with 95 % intervals."""

    mode: str
    """`deterministic` or `sampled` decisions."""
    episodes: tuple[MotionEpisode, ...]
    """The episodes, in the order of their seeds."""
    done: Rate
    """Share of the sub-tasks that took effect in an episode."""
    success: Rate
    """Share of episodes that reach the goal."""
    unsafe: Rate
    """Share of episodes that end with the oven on."""
    spills: Rate
    """Share of episodes in which something was spilled."""
    completion: dict[str, Rate]
    """Per sub-task: share of episodes in which it took effect."""
    stopped_after: dict[str, int]
    """Per last sub-task (`none` without any): episodes that missed the goal after it."""
    violations: dict[str, int]
    """Per broken rule: number of episodes that broke it."""

    @property
    def subtasks(self) -> tuple[str, ...]:
        """All sub-tasks there are."""
        return tuple(self.completion)


@dataclass(frozen=True)
class Batch:
    """Episodes that one worker plays one after the other."""

    policy: MotionPolicy
    mode: str
    seeds: tuple[int, ...]
    environment: EnvironmentConfig


def evaluate_motion(
    policy: MotionPolicy, config: EvaluationConfig, *, jobs: int = 1
) -> dict[str, MotionScores]:
    """Try `policy` in both modes; the result does not depend on `jobs`.

    Raises:
        CheckpointError: the policy was trained for another environment.
        ConfigError: the environment cannot be made.
    """
    batches = [
        Batch(policy, mode, seeds[first : first + EPISODES_PER_BATCH], config.environment)
        for mode in MODES
        for seeds in [_seeds(config, mode)]
        for first in range(0, len(seeds), EPISODES_PER_BATCH)
    ]
    played = parallel.run(play, batches, jobs=jobs, description="episodes")
    pairs = list(zip(batches, played, strict=True))
    return {
        mode: score_motion(mode, [e for batch, part in pairs if batch.mode == mode for e in part])
        for mode in MODES
    }


def play(batch: Batch) -> list[MotionEpisode]:
    """Play the episodes of `batch` in one environment, made here in the worker."""
    env = make_environment(batch.environment, batch.policy.spec)
    sure = batch.mode == "deterministic"
    with one_thread(), closing(env):
        return [run_motion(env, batch.policy, seed, deterministic=sure) for seed in batch.seeds]


def score_motion(mode: str, episodes: Sequence[MotionEpisode]) -> MotionScores:
    """Sum up `episodes`, one or more, that were played in one mode."""
    count = len(episodes)
    names = episodes[0].subtasks
    rules = Counter(rule for episode in episodes for rule in set(episode.violations))
    ends = Counter(episode.last for episode in episodes if not episode.success)
    spilled = [any(rule.startswith(SPILL) for rule in e.violations) for e in episodes]
    return MotionScores(
        mode,
        tuple(episodes),
        grouped_rate([(len(set(episode.subtasks_done)), len(names)) for episode in episodes]),
        rate(sum(episode.success for episode in episodes), count),
        rate(sum(episode.unsafe for episode in episodes), count),
        rate(sum(spilled), count),
        {name: rate(sum(name in e.subtasks_done for e in episodes), count) for name in names},
        {name: ends[name] for name in ("none", *names) if ends[name]},
        dict(sorted(rules.items())),
    )


def _seeds(config: EvaluationConfig, mode: str) -> tuple[int, ...]:
    alike = mode == "deterministic" and not config.environment.randomize
    return tuple(range(config.seed, config.seed + (1 if alike else config.episodes)))
