"""A pool, a weight table and a learner's name -> a policy on disk."""

import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from types import MappingProxyType
from typing import Any

from policies.checkpoint import save_policy
from policies.data.demos import DemosConfig, load_decisions
from policies.data.motions import MotionSamples, load_motions
from policies.data.samples import DecisionSamples
from policies.data.weighting import demo_weights, likely_experts
from policies.learners.registry import LEARNERS, LearnerKind, find_learner
from teasim.common.errors import ConfigError
from teasim.common.files import check_new_folder
from teasim.pool import Pool
from teasim.pool.soundness import require_sound


@dataclass(frozen=True)
class TrainConfig:
    """What is learned, from which part of the pool."""

    learner: str = "bc"
    """Name of the learner."""
    level: str = "subtask"
    """What is chosen: `subtask` or `joint`."""
    weights: Path | None = None
    """Weight table; None: every demonstration counts once."""
    use: str = "ignore"
    """How the table is used: `discard`, `weight` or `ignore`."""
    observe: str = "auto"
    """What the policy sees: `auto`, `pixels`, `pixels_agent_pos` or `state`."""
    expert: tuple[int, ...] = ()
    """Episodes known to be good, for a learner that needs some; empty: the quarter with the largest
    weights in the table."""
    seed: int = 0
    """Seed of the learner."""


def _load_motions(pool: Pool, demos: DemosConfig, *, jobs: int) -> MotionSamples:
    return load_motions(pool, demos.observe, jobs=jobs)


@dataclass(frozen=True)
class Level:
    """What a learner of a level is given."""

    load: Callable[..., DecisionSamples | MotionSamples]
    """Reads it: (pool, demos config, jobs) -> samples."""
    unit: str
    """What the rows of the samples are."""


LEVELS: Mapping[str, Level] = MappingProxyType(
    {
        "subtask": Level(load_decisions, "decisions"),
        "joint": Level(_load_motions, "control steps"),
    }
)


def train_policy(pool_path: Path, run: Path, config: TrainConfig, *, jobs: int = 1) -> str:
    """Train on the pool at `pool_path`, save the policy in the new folder `run`, sum up in a line.

    `run` is made last, so nothing is left behind when the input is bad.

    Raises:
        ConfigError: a name is unknown, the table does not fit the pool, or `run` is in use.
        PoolError: the pool is missing or damaged.
    """
    kind = find_learner(config.learner, config.level)
    demos = DemosConfig(observe=config.observe)
    pool = Pool.open(pool_path)
    require_sound(pool)
    weights = demo_weights(pool, config.weights, config.use)
    settings = expert_settings(kind, pool, config)
    check_new_folder(run)
    began = time.perf_counter()
    level = LEVELS[config.level]
    samples = level.load(pool, demos, jobs=jobs)
    learner = kind.make(seed=config.seed, **settings).fit(samples, weights)
    training = {
        **asdict(config),
        "weights": None if config.weights is None else str(config.weights),
        "settings": asdict(learner.config),
        "demo_weights": {e.demo_id: w for e, w in zip(pool.episodes, weights, strict=True)},
        "pool": pool.content_hash(),
        "version": version("teasim"),
        "history": learner.history_,
    }
    save_policy(learner.policy_, run, training=training)
    seconds = time.perf_counter() - began
    return (
        f"{config.learner} on {int((weights > 0).sum())} of {len(weights)} demonstrations, "
        f"{len(samples.demos)} {level.unit}, loss {learner.history_[-1]:.3f}, "
        f"{seconds:.0f} s -> {run}"
    )


def expert_settings(kind: LearnerKind, pool: Pool, config: TrainConfig) -> dict[str, Any]:
    """Return the setting `experts`, places in the pool, for a learner that takes it.

    Raises:
        ConfigError: it needs experts and there is no way to choose them, it takes none, or an
            episode is not in the pool.
    """
    if not kind.takes_experts:
        if config.expert:
            takers = [name for name, other in LEARNERS.items() if other.takes_experts]
            raise ConfigError(
                f"The learner '{config.learner}' takes no --expert; only {', '.join(takers)} does."
            )
        return {}
    if config.expert:
        return {"experts": places_of(pool, config.expert)}
    if config.weights is None:
        raise ConfigError(
            f"The learner '{config.learner}' needs demonstrations known to be good; name their "
            "episodes with --expert, or give a weight table with --weights."
        )
    return {"experts": likely_experts(pool, config.weights)}


def places_of(pool: Pool, episodes: tuple[int, ...]) -> tuple[int, ...]:
    """Places in `pool` of the episodes with these indexes.

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
