"""Scores of a joint-level policy: how many sub-tasks it completes, judged by the simulation.

Deterministic decisions begin with the nearest demonstration, sampled ones with one drawn for each
episode. If nothing on the table moves, all deterministic episodes are the same; one is run.
"""

from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass

from filtering.vision.determinism import one_thread
from policies.learners.motion_policy import JointPolicy
from policies.play.environments import make_environment
from policies.play.evaluation import MODES, batches
from policies.play.joint_rollout import MotionEpisode, run_motion
from policies.play.outcomes import Outcomes, tally
from policies.settings import EnvironmentConfig, EvaluationConfig
from teasim.common import parallel
from teasim.common.statistics import Rate, grouped_rate
from teasim.common.workers import IN_PROCESS, Workers


@dataclass(frozen=True)
class MotionScores(Outcomes):
    """Scores of one mode; all rates with 95 % intervals."""

    episodes: tuple[MotionEpisode, ...]
    """The episodes, in the order of their seeds."""
    done: Rate
    """Share of the sub-tasks that took effect in an episode."""
    stopped_after: dict[str, int]
    """Per last sub-task (`none` without any): episodes that missed the goal after it."""

    @property
    def subtasks(self) -> tuple[str, ...]:
        """All sub-tasks of the environment."""
        return tuple(self.completion)

    @property
    def mean_done(self) -> float:
        """Mean number of sub-tasks that took effect in an episode."""
        return len(self.subtasks) * self.done.value


@dataclass(frozen=True)
class MotionBatch:
    """Episodes that one worker runs one after the other."""

    policy: JointPolicy
    """The policy."""
    mode: str
    """`deterministic` or `sampled` decisions."""
    seeds: tuple[int, ...]
    """Seeds of the episodes."""
    environment: EnvironmentConfig
    """Settings of the environment."""


def evaluate_motion(
    policy: JointPolicy, config: EvaluationConfig, *, workers: Workers = IN_PROCESS
) -> dict[str, MotionScores]:
    """Score `policy` in each mode it has; the result does not depend on `workers`.

    A policy that draws nothing has the deterministic mode alone.

    Raises:
        CheckpointError: the policy was trained for another environment.
        ConfigError: the environment cannot be made.
    """
    environment = config.environment.at_level("joint")
    modes = MODES if policy.draws else MODES[:1]
    work = [
        MotionBatch(policy, mode, seeds, environment)
        for mode in modes
        for seeds in batches(_seeds(config, mode))
    ]
    played = parallel.run(_play_batch, work, workers=workers, description="episodes")
    pairs = list(zip(work, played, strict=True))
    return {
        mode: score_motion(mode, [e for batch, part in pairs if batch.mode == mode for e in part])
        for mode in modes
    }


def _play_batch(batch: MotionBatch) -> list[MotionEpisode]:
    """Run the episodes of `batch` in one environment made in this worker."""
    env = make_environment(batch.environment, batch.policy.spec)
    sure = batch.mode == "deterministic"
    with one_thread(), closing(env):
        return [run_motion(env, batch.policy, seed, deterministic=sure) for seed in batch.seeds]


def score_motion(mode: str, episodes: Sequence[MotionEpisode]) -> MotionScores:
    """Score `episodes`, one or more, that were run in one mode."""
    names = episodes[0].subtasks
    ends = Counter(episode.last for episode in episodes if not episode.success)
    done = [(len(set(episode.subtasks_done)), len(names)) for episode in episodes]
    return MotionScores(
        **tally(mode, episodes, names),
        episodes=tuple(episodes),
        done=grouped_rate(done),
        stopped_after={name: ends[name] for name in ("none", *names) if ends[name]},
    )


def _seeds(config: EvaluationConfig, mode: str) -> tuple[int, ...]:
    alike = mode == "deterministic" and not config.environment.randomize
    return tuple(range(config.seed, config.seed + (1 if alike else config.episodes)))
