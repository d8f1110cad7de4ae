"""Scores of a joint-level policy: how far it gets, by what physics shows.

Deterministic decisions keep to the typical style, sampled ones to one drawn for each episode. Where
nothing on the table is moved, deterministic episodes would all be the same one: it is played once.
"""

from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass

from filtering.vision.determinism import one_thread
from policies.learners.motion_policy import MotionPolicy
from policies.play.evaluation import MODES, EvaluationConfig, batches
from policies.play.joint_rollout import MotionEpisode, run_motion
from policies.play.outcomes import Outcomes, tally
from policies.play.rollout import EnvironmentConfig, make_environment
from teasim.common import parallel
from teasim.common.statistics import Rate, grouped_rate


@dataclass(frozen=True)
class MotionScores(Outcomes):
    """What the episodes of one mode come to; all rates with 95 % intervals."""

    mode: str
    """`deterministic` or `sampled` decisions."""
    episodes: tuple[MotionEpisode, ...]
    """The episodes, in the order of their seeds."""
    done: Rate
    """Share of the sub-tasks that took effect in an episode."""
    stopped_after: dict[str, int]
    """Per last sub-task (`none` without any): episodes that missed the goal after it."""

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
    work = [
        Batch(policy, mode, seeds, config.environment)
        for mode in MODES
        for seeds in batches(_seeds(config, mode))
    ]
    played = parallel.run(play, work, jobs=jobs, description="episodes")
    pairs = list(zip(work, played, strict=True))
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
    names = episodes[0].subtasks
    ends = Counter(episode.last for episode in episodes if not episode.success)
    done = [(len(set(episode.subtasks_done)), len(names)) for episode in episodes]
    return MotionScores(
        **tally(episodes, names),
        mode=mode,
        episodes=tuple(episodes),
        done=grouped_rate(done),
        stopped_after={name: ends[name] for name in ("none", *names) if ends[name]},
    )


def _seeds(config: EvaluationConfig, mode: str) -> tuple[int, ...]:
    alike = mode == "deterministic" and not config.environment.randomize
    return tuple(range(config.seed, config.seed + (1 if alike else config.episodes)))
