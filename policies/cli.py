"""The verbs of this floor: train, evaluate, ablate, demo. Options only; the work is done elsewhere.

Nothing heavy is imported before a verb's options were understood.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from teasim.common.parallel import default_jobs

if TYPE_CHECKING:
    from policies.learners.motion_policy import MotionPolicy
    from policies.learners.subtask_policy import SubtaskPolicy

Output = Annotated[Path, tyro.conf.arg(aliases=["-o"])]


@dataclass(frozen=True)
class TrainOptions:
    """Train a policy on a pool of demonstrations."""

    pool: tyro.conf.Positional[Path]
    """Folder of the pool."""
    output: Output
    """New folder for the policy."""
    learner: str = "bc"
    """Learner: bc, bc-rnn (with a memory), bcnd, demodice or r-maxent (against wrong
    demonstrations); nearest at the level joint."""
    level: str = "subtask"
    """What is decided: subtask (which comes next) or joint (where the joints go; nearest)."""
    weights: Path | None = None
    """Weight table (weights.csv of `teasim filter`)."""
    use: str | None = None
    """How weights are used: discard (drop flagged demonstrations), weight, ignore; default: discard
    when there is a weight table."""
    observe: str = "auto"
    """What the policy sees: pixels, pixels_agent_pos, auto (joints where the pool logs them), or
    state (joints and environment state, no pictures: fast)."""
    expert: tuple[int, ...] = ()
    """Episodes known to be good, for demodice; default: the quarter with the largest weights."""
    seed: int = 0
    """Seed of the learner."""
    jobs: int = default_jobs()
    """Processes that read the pool."""


@dataclass(frozen=True)
class EvaluateOptions:
    """Run a trained policy in the environment and score it."""

    run: tyro.conf.Positional[Path]
    """Folder of the policy."""
    episodes: int = 50
    """Episodes per mode (deterministic and sampled decisions)."""
    seed: int = 1000
    """Seed of the first episode."""
    min_policy_accuracy: float | None = None
    """Least policy accuracy [%] (strict, deterministic decisions); below it the exit code is 1."""
    against: Path | None = None
    """Folder of another policy to compare with on the same episodes."""
    json: Path | None = None
    """File for all scores and episodes."""
    junit: Path | None = None
    """File for a build server."""
    video: Path | None = None
    """Folder for what the policy saw, one frame per decision with the choice written below it."""
    env_id: str | None = None
    """Gymnasium id of the environment; default: TeaMakingSubtasks-v0 for a policy over sub-tasks,
    TeaMaking-v0 for one over joints."""
    randomize: bool = True
    """Move and turn the things on the table from episode to episode."""
    quality: str = "fast"
    """Look of the pictures, fast or nice; should be that of the pool."""
    max_actions: int = 14
    """Actions after which an episode is cut off; at the joint level 30 s without a new sub-task end
    it."""
    jobs: int = default_jobs()
    """Processes that play episodes."""


@dataclass(frozen=True)
class DemoOptions:
    """Do the main job, small, start to end: generate, filter, train, compare, report."""

    output: Output
    """New folder for the pool, the filter's findings, the policies and the report."""
    seq1: int = 10
    """Correct demonstrations (Seq_1)."""
    seq3: int = 4
    """Incorrect demonstrations (Seq_3)."""
    episodes: int = 12
    """Episodes per policy and mode."""
    seed: int = 0
    """Seed of everything that is random."""
    jobs: int = default_jobs()
    """Processes."""


@dataclass(frozen=True)
class AblateOptions:
    """Train and score policies over pools x filters x learners x seeds."""

    config: tyro.conf.Positional[Path]
    """TOML file that says what is varied (policies/experiments/ablation_config.py has one)."""
    output: Output
    """Folder for the results; one that holds a part of them is gone on with."""
    jobs: int = default_jobs()
    """Processes."""


def train(argv: Sequence[str]) -> int:
    """Train a policy on a pool of demonstrations."""
    options = tyro.cli(TrainOptions, args=list(argv), prog="teasim train")
    from policies.training import TrainConfig, train_policy

    use = options.use or ("ignore" if options.weights is None else "discard")
    config = TrainConfig(
        options.learner,
        options.level,
        options.weights,
        use,
        options.observe,
        options.expert,
        options.seed,
    )
    print(train_policy(options.pool, options.output, config, jobs=options.jobs))
    return 0


def evaluate(argv: Sequence[str]) -> int:
    """Run a trained policy in the environment and score it."""
    options = tyro.cli(EvaluateOptions, args=list(argv), prog="teasim evaluate")
    from policies.checkpoint import load_policy
    from policies.learners.motion_policy import MotionPolicy
    from policies.outputs import check_file

    check_file(options.json)
    check_file(options.junit)
    policy = load_policy(options.run)
    if isinstance(policy, MotionPolicy):
        return _evaluate_joints(policy, options)
    return _evaluate_subtasks(policy, options)


def _evaluate_subtasks(policy: "SubtaskPolicy", options: EvaluateOptions) -> int:
    """Run a policy over sub-tasks and score its choices."""
    from policies.play.comparison import compare, comparison_json, comparison_text
    from policies.play.evaluation import EvaluationConfig, evaluate_all
    from policies.play.results import Bar, summary, write_junit, write_scores
    from policies.play.rollout import ENVIRONMENT, EnvironmentConfig

    bar = None if options.min_policy_accuracy is None else Bar(options.min_policy_accuracy)
    world = EnvironmentConfig(
        options.env_id or ENVIRONMENT, options.quality, options.randomize, options.max_actions
    )
    config = EvaluationConfig(options.episodes, options.seed, world, options.video)
    rivals = [] if options.against is None else [_load_rival(options.against)]
    scores, *others = evaluate_all([policy, *rivals], config, jobs=options.jobs)
    about = {"run": str(options.run), "version": version("teasim"), "world": asdict(world)}
    print(summary(scores))
    for other in others:
        found = compare(scores, other)
        about |= {"against": str(options.against), "comparison": comparison_json(found)}
        print(comparison_text(found, str(options.against)))
    if options.json:
        write_scores(options.json, scores, about)
    if options.junit:
        write_junit(options.junit, scores, bar)
    if bar is None or bar.passed(scores):
        return 0
    print(f"policy accuracy is below {bar.percent:g} %")
    return 1


def _load_rival(run: Path) -> "SubtaskPolicy":
    """Read a policy that one over sub-tasks can be compared with."""
    from policies.checkpoint import load_policy
    from policies.learners.motion_policy import MotionPolicy
    from teasim.common.errors import ConfigError

    policy = load_policy(run)
    if isinstance(policy, MotionPolicy):
        raise ConfigError(
            f"'{run}' holds a policy of the joint level; a comparison needs two over sub-tasks."
        )
    return policy


def _evaluate_joints(policy: "MotionPolicy", options: EvaluateOptions) -> int:
    """Run a policy of the joint level and score how far it gets."""
    from policies.play.evaluation import EvaluationConfig
    from policies.play.joint_evaluation import evaluate_motion
    from policies.play.joint_results import motion_json, motion_summary
    from policies.play.joint_rollout import JOINT_ENVIRONMENT
    from policies.play.rollout import EnvironmentConfig
    from teasim.common.errors import ConfigError
    from teasim.common.files import write_json

    asked = (options.min_policy_accuracy, options.against, options.junit, options.video)
    if any(option is not None for option in asked):
        raise ConfigError(
            "A policy at the joint level chooses no sub-tasks; leave out --min-policy-accuracy, "
            "--against, --junit and --video."
        )
    world = EnvironmentConfig(
        options.env_id or JOINT_ENVIRONMENT, options.quality, options.randomize, max_actions=None
    )
    scores = evaluate_motion(
        policy, EvaluationConfig(options.episodes, options.seed, world), jobs=options.jobs
    )
    print(motion_summary(scores))
    if options.json:
        about = {"run": str(options.run), "version": version("teasim"), "world": asdict(world)}
        write_json(options.json, about | {"scores": motion_json(scores)})
    return 0


def demo(argv: Sequence[str]) -> int:
    """Do the main job, small, start to end: generate, filter, train, compare, report."""
    options = tyro.cli(DemoOptions, args=list(argv), prog="teasim demo")
    from policies.experiments.demo import DemoConfig, run_demo

    config = DemoConfig(options.seq1, options.seq3, options.episodes, options.seed)
    print(run_demo(options.output, config, jobs=options.jobs))
    return 0


def ablate(argv: Sequence[str]) -> int:
    """Train and score policies over pools x filters x learners x seeds."""
    options = tyro.cli(AblateOptions, args=list(argv), prog="teasim ablate")
    from policies.experiments.ablation import run_ablation
    from policies.experiments.ablation_config import AblationConfig

    config = AblationConfig.read(options.config)
    print(run_ablation(config, options.output, jobs=options.jobs))
    return 0
