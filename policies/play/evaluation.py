"""Scores of a policy: policy accuracy (the paper, section 4.3), success, safety, completion.

Each episode is played twice: with the likeliest sub-task at every decision, and with a drawn one.
The first can outvote a minority of incorrect demonstrations, the second shows what was learned from
them.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym

from filtering.vision.determinism import one_thread
from policies.data.samples import ObservationSpec, Policy
from policies.play.outcomes import Outcomes, tally
from policies.play.remembering import Remembering, can_remember
from policies.play.rollout import EnvironmentConfig, Episode, make_environment, run_episode
from teasim.common import parallel
from teasim.common.errors import ConfigError
from teasim.common.statistics import Rate, grouped_rate

MODES = ("deterministic", "sampled")

EPISODES_PER_BATCH = 4
"""Episodes that share one environment: few enough to keep all workers busy until the end."""

World = Callable[[ObservationSpec], gym.Env[Any, Any]]
"""Gives the environment in which policies that see so play."""


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
class Scores(Outcomes):
    """What the episodes of one mode come to; all rates with 95 % intervals."""

    mode: str
    """`deterministic` or `sampled` decisions."""
    episodes: tuple[Episode, ...]
    """The episodes, in the order of their seeds."""
    policy_accuracy: Rate
    """Share of executed actions that are the reference's (Seq_1) next step (strict)."""
    lenient_accuracy: Rate
    """Share of executed actions that the precedence of the sub-tasks allows."""


@dataclass(frozen=True)
class Batch:
    """Scenes that one worker plays one after the other."""

    policies: tuple[Policy, ...]
    seeds: tuple[int, ...]
    config: EvaluationConfig


def evaluate(policy: Policy, config: EvaluationConfig, *, jobs: int = 1) -> dict[str, Scores]:
    """Try `policy` in both modes; the result does not depend on `jobs`.

    Raises:
        CheckpointError: the policy was trained for another environment.
        ConfigError: the environment cannot be made.
    """
    return evaluate_all([policy], config, jobs=jobs)[0]


def evaluate_all(
    policies: Sequence[Policy], config: EvaluationConfig, *, jobs: int = 1
) -> list[dict[str, Scores]]:
    """Try all `policies` in the same scenes; what they do alike is carried out once.

    Each gets the scores that `evaluate` gives it alone. Only the first is filmed.

    Raises:
        CheckpointError: a policy was trained for another environment.
        ConfigError: the environment cannot be made.
    """
    work = [
        Batch(tuple(policies), seeds, config)
        for seeds in batches(range(config.seed, config.seed + config.episodes))
    ]
    parts = parallel.run(_play_batch, work, jobs=jobs, description="episodes")
    return [
        {
            mode: score(mode, [e for part in parts for e in part[n][mode]], policy.action_names)
            for mode in MODES
        }
        for n, policy in enumerate(policies)
    ]


@contextmanager
def worlds(config: EnvironmentConfig, *, filmed: bool = False) -> Iterator[World]:
    """Open what gives policies their environments; those that see alike share one."""
    with ExitStack() as stack:
        made: dict[ObservationSpec, gym.Env[Any, Any]] = {}

        def world(spec: ObservationSpec) -> gym.Env[Any, Any]:
            if spec not in made:
                env = stack.enter_context(closing(make_environment(config, spec, filmed=filmed)))
                made[spec] = Remembering(env) if can_remember(env) else env
            return made[spec]

        yield world


def play(
    env: gym.Env[Any, Any], policy: Policy, seeds: Sequence[int], film: Path | None = None
) -> dict[str, list[Episode]]:
    """Play the scenes `seeds` in both modes; `film` is a folder for the deterministic ones."""
    with one_thread():
        return {
            mode: [
                run_episode(
                    env,
                    policy,
                    seed,
                    deterministic=mode == "deterministic",
                    video=film / f"episode_{seed}.mp4" if film and mode == MODES[0] else None,
                )
                for seed in seeds
            ]
            for mode in MODES
        }


def _play_batch(batch: Batch) -> list[dict[str, list[Episode]]]:
    """Play `batch` in environments made here in the worker."""
    film = batch.config.video
    with worlds(batch.config.environment, filmed=film is not None) as world:
        return [
            play(world(policy.spec), policy, batch.seeds, None if n else film)
            for n, policy in enumerate(batch.policies)
        ]


def score(mode: str, episodes: Sequence[Episode], subtasks: Sequence[str]) -> Scores:
    """Sum up `episodes` that were played in one mode."""
    allowed = [(sum(a.allowed for a in e.actions), len(e.actions)) for e in episodes]
    return Scores(
        **tally(episodes, subtasks),
        mode=mode,
        episodes=tuple(episodes),
        policy_accuracy=grouped_rate([(e.n_correct, len(e.actions)) for e in episodes]),
        lenient_accuracy=grouped_rate(allowed),
    )


def batches(seeds: Sequence[int]) -> list[tuple[int, ...]]:
    """Divide `seeds` among workers."""
    size = EPISODES_PER_BATCH
    return [tuple(seeds[first : first + size]) for first in range(0, len(seeds), size)]
