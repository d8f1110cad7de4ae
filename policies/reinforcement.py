"""`teasim train POOL --learner ppo`: a policy is trained by reinforcement and saved."""

import time
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from policies.checkpoint import load_policy, save_policy
from policies.data.demos import DemosConfig, load_decisions
from policies.learners.options import parse_assignments, read_options
from policies.learners.registry import LearnerKind
from policies.learners.subtask_policy import SubtaskPolicy
from policies.ppo import PPOConfig, Update, improve, untrained
from policies.settings import PPO_LEARNER, TrainSettings
from teasim.common.errors import ConfigError
from teasim.common.figures import CurvesFigure, save_figures
from teasim.common.files import check_new_folder
from teasim.common.workers import IN_PROCESS
from teasim.pool import Pool

KIND = LearnerKind(type(None), PPOConfig, ("subtask",))
"""Names its settings for `--set`; it is no learner of the registry, which learn from samples."""
REFUSED = {
    "level": ("subtask",),
    "observe": ("auto", "state"),
    "camera": ((),),
    "weights": (None,),
    "use": (None,),
    "expert": ((),),
}
"""Values that settings of `teasim train` may have for this learner."""


@dataclass(frozen=True)
class Reinforcement:
    """A policy that was trained by reinforcement and saved; its text is a summary in one line."""

    policy: SubtaskPolicy
    """The policy."""
    out: Path
    """Folder it was saved in."""
    start: Path | None
    """Folder of the policy it began as; None: it began with nothing."""
    curve: tuple[Update, ...]
    """The learning curve."""
    seconds: float
    """Wall time [s]."""

    def __str__(self) -> str:
        last = self.curve[-1]
        share = "" if last.success is None else f", goal reached in {100 * last.success:.1f} %"
        return (
            f"ppo from {self.start or 'nothing'}, {last.decisions} decisions{share} of the last "
            f"{last.episodes} episodes, {self.seconds:.0f} s -> {self.out}"
        )


def reinforce(settings: TrainSettings) -> Reinforcement:
    """Train the policy in `settings.start`, or none, by reinforcement and save the result.

    The pool says what the policy sees and, if it begins with nothing, on what scale; nothing else
    is learned from its demonstrations. The folder is made last.

    Raises:
        CheckpointError: the folder to begin with holds no policy.
        ConfigError: a setting does not fit, the policy cannot become a PPO model or sees other
            numbers than the pool logs, or the folder is in use.
        PoolError: the pool is missing or damaged.
    """
    _check(settings)
    given = parse_assignments(settings.learner_settings)
    config = PPOConfig(seed=settings.seed, **read_options(PPO_LEARNER, KIND, given))
    pool = Pool.open(settings.pool)
    check_new_folder(settings.out)
    samples = load_decisions(pool, DemosConfig(observe="state"), workers=settings.workers)
    start = untrained(samples) if settings.start is None else _load(settings.start)
    if (start.spec, start.action_names) != (samples.spec, samples.action_names):
        raise ConfigError(
            f"The policy '{settings.start}' does not see what '{settings.pool}' logs; "
            "give the pool that it was trained on, and train it with --observe state."
        )
    began = time.perf_counter()
    workers = IN_PROCESS if settings.workers.jobs is None else settings.workers
    policy, curve = improve(start, config, workers=workers)
    record = {
        "learner": PPO_LEARNER,
        "from": None if settings.start is None else str(settings.start),
        "seed": settings.seed,
        "settings": asdict(config),
        "pool": pool.content_hash(),
        "version": version("teasim"),
        "history": [asdict(update) for update in curve],
    }
    save_policy(policy, settings.out, training=record)
    if settings.figures is not None:
        reached = tuple(100 * update.success for update in curve if update.success is not None)
        drawing = CurvesFigure({PPO_LEARNER: reached}, "goal reached [%]", "update with episodes")
        save_figures(settings.figures, {"training": drawing})
    seconds = time.perf_counter() - began
    return Reinforcement(policy, settings.out, settings.start, curve, seconds)


def _check(settings: TrainSettings) -> None:
    for name, values in REFUSED.items():
        if getattr(settings, name) not in values:
            raise ConfigError(
                f"The learner 'ppo' learns from the state at the level subtask, not from "
                f"demonstrations; leave out --{name}."
            )


def _load(folder: Path) -> SubtaskPolicy:
    policy = load_policy(folder)
    if not isinstance(policy, SubtaskPolicy):
        raise ConfigError(f"The policy '{folder}' chooses no sub-tasks; ppo needs one that does.")
    return policy
