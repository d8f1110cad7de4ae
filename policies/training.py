"""A pool, a weight table and a learner's name -> a policy on disk."""

import time
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from policies.checkpoint import save_policy
from policies.demos import DemosConfig, load_decisions
from policies.learners import find_learner
from policies.weighting import demo_weights
from teasim.pool import Pool
from teasim.pool.files import check_new_folder


@dataclass(frozen=True)
class TrainConfig:
    """What is learned, from which part of the pool."""

    learner: str = "bc"
    """Name of the learner."""
    level: str = "subtask"
    """What is chosen: `subtask`."""
    weights: Path | None = None
    """Weight table; None: every demonstration counts once."""
    use: str = "ignore"
    """How the table is used: `discard`, `weight` or `ignore`."""
    observe: str = "auto"
    """What the policy sees: `auto`, `pixels` or `pixels_agent_pos`."""
    seed: int = 0
    """Seed of the learner."""


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
    weights = demo_weights(pool, config.weights, config.use)
    check_new_folder(run)
    began = time.perf_counter()
    samples = load_decisions(pool, demos, jobs=jobs)
    learner = kind.make(seed=config.seed).fit(samples, weights)
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
        f"{len(samples.labels)} decisions, loss {learner.history_[-1]:.3f}, "
        f"{seconds:.0f} s -> {run}"
    )
