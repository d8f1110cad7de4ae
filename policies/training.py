"""Train a policy: a pool, a weight table and a learner's name become a policy on disk."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from policies.checkpoint import AnyPolicy, save_policy
from policies.data.demos import DemosConfig, load_decisions
from policies.data.found import weight_table, with_found_subtasks
from policies.data.motions import MotionSamples, check_log, load_motions
from policies.data.samples import DecisionSamples
from policies.data.weighting import demo_weights, likely_experts
from policies.learners.options import parse_assignments, read_options
from policies.learners.registry import (
    EXPERTS,
    LOG,
    LearnerKind,
    find_learner,
    learners_that_need,
)
from policies.settings import PPO_LEARNER, TrainSettings
from teasim.common.errors import ConfigError
from teasim.common.figures import CurvesFigure, check_figures, save_figures
from teasim.common.files import check_new_folder
from teasim.common.workers import Workers
from teasim.pool import Pool
from teasim.pool.soundness import print_notes, require_sound

if TYPE_CHECKING:
    from policies.reinforcement import Reinforcement

LOSSES = "losses.csv"
"""File of the training losses in the folder of a policy."""
RECORDED = ("learner", "level", "observe", "camera", "expert", "seed")
"""Settings that are stored with a policy as they were given."""


@dataclass(frozen=True)
class Level:
    """What a learner of a level is given."""

    load: Callable[..., DecisionSamples | MotionSamples]
    """Reads the samples: (pool, demos config, workers) -> samples."""
    unit: str
    """What a row of the samples is, in the plural."""


def _load_motions(pool: Pool, demos: DemosConfig, *, workers: Workers) -> MotionSamples:
    if demos.cameras:
        raise ConfigError("The level 'joint' sees no pictures; leave out --camera.")
    return load_motions(pool, demos.observe, workers=workers)


LEVELS: Mapping[str, Level] = MappingProxyType(
    {
        "subtask": Level(load_decisions, "decisions"),
        "joint": Level(_load_motions, "control steps"),
    }
)


@dataclass(frozen=True)
class Training:
    """A policy that was trained and saved; its text is a summary in one line."""

    policy: AnyPolicy
    """The policy."""
    out: Path
    """Folder it was saved in."""
    learner: str
    """Name of the learner."""
    used: int
    """Demonstrations with a positive weight."""
    demos: int
    """Demonstrations in the pool."""
    rows: str
    """How much it learned from, for example `96 decisions`."""
    loss: float
    """Last training loss [nat per decision; spreads of a joint target]."""
    seconds: float
    """Wall time of reading and learning [s]."""

    def __str__(self) -> str:
        return (
            f"{self.learner} on {self.used} of {self.demos} demonstrations, {self.rows}, "
            f"loss {self.loss:.3f}, {self.seconds:.0f} s -> {self.out}"
        )


def train(settings: TrainSettings) -> "Training | Reinforcement":
    """Train a policy on the pool and save it in the new folder `settings.out`.

    The folder is made last, so a bad input leaves nothing behind.

    Raises:
        ConfigError: a name is unknown, the table does not fit the pool, or the folder is in use.
        PoolError: the pool is missing or damaged.
    """
    check_figures(settings.figures)
    if settings.learner == PPO_LEARNER:
        from policies.reinforcement import reinforce  # loads stable-baselines3

        return reinforce(settings)
    if settings.start is not None:
        raise ConfigError(
            f"The learner '{settings.learner}' takes no --from; only {PPO_LEARNER} does."
        )
    kind = find_learner(settings.learner, settings.level)
    options = read_options(settings.learner, kind, parse_assignments(settings.learner_settings))
    demos = DemosConfig(observe=settings.observe, cameras=settings.camera)
    pool = Pool.open(settings.pool)
    require_sound(pool)
    print_notes(pool)
    weights = demo_weights(pool, weight_table(settings.weights), settings.chosen_use)
    pool = with_found_subtasks(pool, settings.segments, settings.weights, settings.names)
    options |= provide(kind, pool, settings)
    check_new_folder(settings.out)
    began = time.perf_counter()
    level = LEVELS[settings.level]
    samples = level.load(pool, demos, workers=settings.workers)
    learner = kind.make(seed=settings.seed, **options).fit(samples, weights)
    record = _record(settings, pool, weights.tolist()) | {
        "settings": asdict(learner.config),
        "history": learner.history_,
    }
    save_policy(learner.policy_, settings.out, training=record)
    _show_losses(settings, learner.history_)
    return Training(
        policy=learner.policy_,
        out=settings.out,
        learner=settings.learner,
        used=int((weights > 0).sum()),
        demos=len(weights),
        rows=f"{len(samples.demos)} {level.unit}",
        loss=float(learner.history_[-1]),
        seconds=time.perf_counter() - began,
    )


def _record(settings: TrainSettings, pool: Pool, weights: list[float]) -> dict[str, Any]:
    """Return what a policy is trained on and how, as JSON can hold it."""
    return {
        **{name: getattr(settings, name) for name in RECORDED},
        "weights": None if settings.weights is None else str(settings.weights),
        "use": settings.chosen_use,
        "demo_weights": {e.demo_id: w for e, w in zip(pool.episodes, weights, strict=True)},
        "pool": pool.content_hash(),
        "version": version("teasim"),
    }


def _show_losses(settings: TrainSettings, history: Sequence[float]) -> None:
    """Write the training losses beside the policy, and draw them if figures are asked for."""
    write_losses(history, settings.out / LOSSES)
    if settings.figures is not None:
        curve = CurvesFigure({settings.learner: tuple(map(float, history))})
        save_figures(settings.figures, {"training": curve})


def write_losses(history: Sequence[float], path: Path) -> None:
    """Write the training losses, one row each: number, loss."""
    rows = "".join(f"{number},{loss:.6g}\n" for number, loss in enumerate(history, start=1))
    path.write_text("number,loss\n" + rows, encoding="utf-8")


def provide(kind: LearnerKind, pool: Pool, settings: TrainSettings) -> dict[str, Any]:
    """Return the settings that meet the needs of a learner: `experts`, places in the pool.

    Raises:
        ConfigError: a need cannot be met, experts are given to a learner that needs none, or an
            episode is not in the pool.
    """
    if LOG in kind.needs:
        check_log(pool)
    if EXPERTS in kind.needs:
        return {"experts": _experts(pool, settings)}
    if settings.expert:
        raise ConfigError(
            f"The learner '{settings.learner}' takes no --expert; "
            f"only {', '.join(learners_that_need(EXPERTS))} does."
        )
    return {}


def _experts(pool: Pool, settings: TrainSettings) -> tuple[int, ...]:
    if settings.expert:
        return places_of(pool, settings.expert)
    table = weight_table(settings.weights)
    if table is None:
        raise ConfigError(
            f"The learner '{settings.learner}' needs demonstrations known to be good; name their "
            "episodes with --expert, or give a weight table with --weights."
        )
    return likely_experts(pool, table)


def places_of(pool: Pool, episodes: tuple[int, ...]) -> tuple[int, ...]:
    """Return the places in `pool` of the episodes with these indexes.

    Raises:
        ConfigError: the pool has no such episode.
    """
    indexes = [episode.index for episode in pool.episodes]
    unknown = [episode for episode in episodes if episode not in indexes]
    if unknown:
        raise ConfigError(
            f"'{pool.root}' has no episode {unknown[0]}; choose from {indexes[0]} to {indexes[-1]}."
        )
    return tuple(indexes.index(episode) for episode in episodes)
