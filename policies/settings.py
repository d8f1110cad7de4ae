"""Settings of the verbs of policies, as the command line and Python take them.

This module imports nothing heavy: options are understood before torch is loaded.
"""

from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Annotated

import tyro

from teasim.common.errors import ConfigError
from teasim.common.workers import WorkerOptions, Workers

SUBTASK_ENVIRONMENT = "teasim:teasim/TeaMakingSubtasks-v0"
"""Gymnasium id of the environment whose actions are sub-tasks."""
EVENTS_ENVIRONMENT = "teasim:teasim/TeaMakingEvents-v0"
"""Gymnasium id of the environment whose sub-tasks are drawn instead of simulated."""
JOINT_ENVIRONMENT = "teasim:teasim/TeaMaking-v0"
"""Gymnasium id of the environment whose actions are joint targets."""

PPO_LEARNER = "ppo"
"""Name of the learner that learns by reinforcement; the others learn from demonstrations."""

Out = Annotated[Path, tyro.conf.arg(aliases=["-o"])]
Repeated = Annotated[tuple[str, ...], tyro.conf.UseAppendAction]
Assignments = Annotated[Repeated, tyro.conf.arg(name="set", metavar="NAME=VALUE")]


@dataclass(frozen=True)
class EnvironmentConfig:
    """The environment in which a policy is evaluated."""

    env_id: str | None = None
    """Gymnasium id of the environment; default: TeaMakingSubtasks-v0 for a policy over sub-tasks,
    TeaMaking-v0 for a policy over joints."""
    quality: str = "fast"
    """Rendering quality, fast or nice; use that of the pool."""
    look: str = "fixed"
    """Look of the station, for a policy that sees pictures: fixed, or random, where light, colours,
    camera poses and distractors differ from episode to episode; use that of the pool."""
    randomize: bool = True
    """Move and turn the objects on the table from episode to episode."""
    max_actions: int | None = 14
    """Actions after which an episode is truncated; None: the environment has no such setting. At
    the joint level an episode ends after 30 s without a new sub-task."""

    def at_level(self, level: str) -> "EnvironmentConfig":
        """Return the settings for a policy of `level`, subtask or joint, with the id filled in."""
        if level == "joint":
            return replace(self, env_id=self.env_id or JOINT_ENVIRONMENT, max_actions=None)
        return replace(self, env_id=self.env_id or SUBTASK_ENVIRONMENT)


Environment = Annotated[EnvironmentConfig, tyro.conf.arg(name="")]


@dataclass(frozen=True)
class EvaluationConfig:
    """Which episodes a policy is evaluated in."""

    episodes: int = 50
    """Episodes per mode (deterministic and sampled decisions)."""
    seed: int = 1000
    """Seed of the first episode; the others follow."""
    environment: Environment = field(default_factory=EnvironmentConfig)
    """The environment."""
    video: Path | None = None
    """Folder for videos of the deterministic episodes: the motion of every sub-task, its name
    written below it; one picture per decision where an environment shows no motion."""

    def __post_init__(self) -> None:
        """Raise ConfigError for less than one episode."""
        if self.episodes < 1:
            raise ConfigError(f"episodes is {self.episodes}; choose 1 or more.")


@dataclass(frozen=True, kw_only=True)
class EvaluateSettings(EvaluationConfig):
    """Run a trained policy in the environment and score it."""

    run: tyro.conf.Positional[Path]
    """Folder of the policy, or MODULE:NAME of any object or class with the method `predict`."""
    min_policy_accuracy: float | None = None
    """Least policy accuracy [%] (strict, deterministic decisions); below it the exit code is 1."""
    against: Path | None = None
    """Another policy, compared with the first on the same episodes."""
    json: Path | None = None
    """File for all scores and episodes."""
    junit: Path | None = None
    """JUnit XML file for a build server."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""


@dataclass(frozen=True)
class TrainSettings:
    """Train a policy on a pool of demonstrations."""

    pool: tyro.conf.Positional[Path]
    """Folder of the pool."""
    out: Out
    """New folder for the policy."""
    learner: str = "bc"
    """Learner: bc, bc-rnn (with a memory), bcnd, demodice or r-maxent (robust to incorrect
    demonstrations); act (chunks), bc, bc-rnn or nearest at the level joint; ppo (by
    reinforcement)."""
    learner_settings: Assignments = ()
    """Setting of the learner, for example --set hidden=400; an unknown name lists the choices."""
    level: str = "subtask"
    """What the policy chooses: subtask (the next sub-task) or joint (the joint targets)."""
    weights: Path | None = None
    """Weight table (weights.csv of `teasim filter`), or the output folder of the filter: where the
    pool logs no sub-tasks, those that the filter found are decided on, step 1, step 2, ..."""
    segments: Path | None = None
    """Table of sub-tasks (segments.csv of `teasim filter`) to decide on in place of logged ones."""
    names: Path | None = None
    """File with names for the sub-tasks of the table, as for `teasim label`."""
    use: str | None = None
    """How the table is used: discard (leave out flagged demonstrations), weight, or ignore;
    default: discard if there is a table."""
    observe: str = "auto"
    """What the policy sees: pixels, pixels_agent_pos, auto (joint positions too if the pool logs
    them), or state (joint positions and environment state, no pictures: fast)."""
    camera: Repeated = ()
    """Cameras the policy sees; default: all of the pool."""
    expert: tuple[int, ...] = ()
    """Episodes known to be good, for a learner that needs experts; default: the quarter with the
    largest weights in the table."""
    start: Annotated[Path | None, tyro.conf.arg(name="from")] = None
    """Folder of the policy that ppo trains further; default: it begins with nothing."""
    seed: int = 0
    """Seed of the learner."""
    figures: Path | None = None
    """Folder for figures as SVG and PNG; needs `pip install teasim[figures]`."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""

    @property
    def chosen_use(self) -> str:
        """How the weight table is used, with the default filled in."""
        return self.use or ("ignore" if self.weights is None else "discard")


@dataclass(frozen=True)
class AblateSettings:
    """Train and score policies over pools x filters x learners x seeds."""

    config: tyro.conf.Positional[Path]
    """TOML file that says what is varied; docs/policies.md shows one."""
    out: Out
    """Folder for the results; an unfinished ablation in it is resumed."""
    figures: Path | None = None
    """Folder for figures as SVG and PNG; needs `pip install teasim[figures]`."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""


@dataclass(frozen=True)
class ReproduceSettings:
    """Reproduce the tables and figures of the paper."""

    exhibit: tyro.conf.Positional[str]
    """What is reproduced: table1 to table4, figure4 to figure6, appendix-e, or all."""
    out: Out
    """Folder for the results; an unfinished run in it is resumed."""
    quick: bool = False
    """Do less of everything: all in about a quarter of an hour on two idle cores."""
    dry_run: bool = False
    """Only say what there is to do and about how long it takes."""
    salads: Path | None = None
    """MS-TCN folder of 50-Salads, for table4; without it that table is not run."""
    seed: int = 0
    """Seed of everything random."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a negative seed."""
        if self.seed < 0:
            raise ConfigError(f"The seed is {self.seed}; choose 0 or more.")


@dataclass(frozen=True, kw_only=True)
class DemoSettings:
    """Run the whole method on a small pool: generate, filter, train, evaluate, report."""

    out: Out
    """New folder for the pool, the filter's output, the policies and the report."""
    seq1: int = 10
    """Correct demonstrations (Seq_1)."""
    seq3: int = 4
    """Incorrect demonstrations (Seq_3)."""
    episodes: int = 12
    """Episodes per policy and mode."""
    seed: int = 0
    """Seed of the pool and of the learner."""
    segmenter: str = "auto"
    """Source of the segments that the filter judges, as in `teasim filter`: auto finds them in the
    videos alone, logged reads the labels of the pool."""
    environment: Environment = field(default_factory=partial(EnvironmentConfig, max_actions=10))
    """The environment. Making tea takes 7 actions; a policy that needs 3 more has failed."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""
