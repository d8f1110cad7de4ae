"""Scores of a policy: policy accuracy (the paper, section 4.3), success, safety, completion.

Each episode is played twice: with the likeliest sub-task at every decision, and with a drawn one.
The first can outvote a minority of incorrect demonstrations, the second shows what was learned from
them.
"""

from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from policies.base import Policy
from policies.networks import one_thread
from policies.rollout import EnvironmentConfig, Episode, make_environment, run_episode
from policies.statistics import Rate, grouped_rate, rate
from teasim import parallel
from teasim.errors import ConfigError

MODES = ("deterministic", "sampled")

SPILL = "spilled_"
"""How the violations begin that say something was spilled."""

EPISODES_PER_BATCH = 4
"""Episodes that share one environment: few enough to keep all workers busy until the end."""


@dataclass(frozen=True)
class EvaluationConfig:
    """How a policy is tried out."""

    episodes: int = 50
    """Episodes per mode."""
    seed: int = 1000
    """Seed of the first episode; the others follow."""
    environment: EnvironmentConfig = field(default_factory=EnvironmentConfig)
    """The world."""
    video: Path | None = None
    """Folder for what the policy saw in the deterministic episodes."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a number of episodes that is no number of episodes."""
        if self.episodes < 1:
            raise ConfigError(f"episodes is {self.episodes}; choose 1 or more.")


@dataclass(frozen=True)
class Scores:
    """What the episodes of one mode come to; all rates with 95 % intervals."""

    mode: str
    """`deterministic` or `sampled` decisions."""
    episodes: tuple[Episode, ...]
    """The episodes, in the order of their seeds."""
    policy_accuracy: Rate
    """Share of executed actions that are the reference's (Seq_1) next step (strict)."""
    lenient_accuracy: Rate
    """Share of executed actions that the precedence of the sub-tasks allows."""
    success: Rate
    """Share of episodes that reach the goal."""
    unsafe: Rate
    """Share of episodes that end with the oven on."""
    spills: Rate
    """Share of episodes in which something was spilled."""
    completion: dict[str, Rate]
    """Per sub-task: share of episodes in which it took effect."""
    violations: dict[str, int]
    """Per broken rule: number of episodes that broke it."""


@dataclass(frozen=True)
class Batch:
    """Episodes that one worker plays one after the other."""

    policy: Policy
    mode: str
    seeds: tuple[int, ...]
    environment: EnvironmentConfig
    video: Path | None


def evaluate(policy: Policy, config: EvaluationConfig, *, jobs: int = 1) -> dict[str, Scores]:
    """Try `policy` in both modes; the result does not depend on `jobs`.

    Raises:
        CheckpointError: the policy was trained for another environment.
        ConfigError: the environment cannot be made.
    """
    batches = [
        Batch(policy, mode, seeds, config.environment, _video_of(config, mode))
        for mode in MODES
        for seeds in _batches(range(config.seed, config.seed + config.episodes))
    ]
    played = parallel.run(play, batches, jobs=jobs, description="episodes")
    scores = {}
    for mode in MODES:
        pairs = zip(batches, played, strict=True)
        episodes = [episode for batch, part in pairs if batch.mode == mode for episode in part]
        scores[mode] = score(mode, episodes, policy.action_names)
    return scores


def play(batch: Batch) -> list[Episode]:
    """Play the episodes of `batch` in one environment, made here in the worker."""
    filmed = batch.video is not None
    env = make_environment(batch.environment, batch.policy.spec, filmed=filmed)
    with one_thread(), closing(env):
        return [
            run_episode(
                env,
                batch.policy,
                seed,
                deterministic=batch.mode == "deterministic",
                video=batch.video / f"episode_{seed}.mp4" if batch.video else None,
            )
            for seed in batch.seeds
        ]


def score(mode: str, episodes: Sequence[Episode], subtasks: Sequence[str]) -> Scores:
    """Sum up `episodes` that were played in one mode."""
    count = len(episodes)
    rules = Counter(rule for episode in episodes for rule in set(episode.violations))
    return Scores(
        mode,
        tuple(episodes),
        grouped_rate([(e.n_correct, len(e.actions)) for e in episodes]),
        grouped_rate([(sum(a.allowed for a in e.actions), len(e.actions)) for e in episodes]),
        rate(sum(episode.success for episode in episodes), count),
        rate(sum(episode.unsafe for episode in episodes), count),
        rate(sum(_spilled(episode) for episode in episodes), count),
        {
            name: rate(sum(name in episode.subtasks_done for episode in episodes), count)
            for name in subtasks
        },
        dict(sorted(rules.items())),
    )


def _spilled(episode: Episode) -> bool:
    return any(rule.startswith(SPILL) for rule in episode.violations)


def _batches(seeds: Sequence[int]) -> list[tuple[int, ...]]:
    size = EPISODES_PER_BATCH
    return [tuple(seeds[first : first + size]) for first in range(0, len(seeds), size)]


def _video_of(config: EvaluationConfig, mode: str) -> Path | None:
    return config.video if mode == "deterministic" else None
