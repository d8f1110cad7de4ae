"""Ablations: pools x filters x learners x seeds, each combination trained and evaluated.

Each combination is a cell. All policies run in the same episodes, and the scores of a cell are kept
in a file of its own, so an interrupted ablation can be resumed. The labels of a pool are read for
the use `labels` alone.
"""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from filtering.demo_filter import DemoFilter
from policies.data.demos import DemosConfig, load_decisions
from policies.data.samples import DecisionSamples
from policies.data.weighting import demo_weights
from policies.experiments.ablation_config import AblationConfig
from policies.experiments.ablation_tables import Cell, as_csv, as_markdown
from policies.experiments.variants import LABELS, FilterVariant, LearnerVariant
from policies.learners.registry import EXPERTS
from policies.play.environments import World, worlds
from policies.play.evaluation import MODES, Scores, play, score
from policies.play.results import as_json
from policies.play.rollout import Action, Episode
from policies.settings import AblateSettings, EnvironmentConfig
from policies.training import places_of
from teasim.common import parallel
from teasim.common.errors import ConfigError
from teasim.common.files import check_new_folder, write_json, write_text
from teasim.common.workers import Workers
from teasim.pool import Pool
from teasim.pool.weight_table import write_weight_table

RECORD = "ablation.json"
"""File that says what ablation a folder is for."""


@dataclass(frozen=True)
class Run:
    """A cell that has no scores yet, and what its policy learns from."""

    cell: Cell
    """The cell."""
    learner: LearnerVariant
    """The learner and its settings."""
    samples: DecisionSamples
    """Decisions of the pool."""
    weights: NDArray[np.float64]
    """Weight of each demonstration.  # (D,)"""
    experts: tuple[int, ...]
    """Places in the pool of demonstrations known to be good."""


def run_ablation(settings: AblateSettings) -> str:
    """Run what has no scores yet and return the table of results.

    Writes `results.csv` (a row per cell and mode) and `results.md` (training seeds pooled).

    Raises:
        ConfigError: the configuration is unusable, or the output folder is in use.
        PoolError: a pool is missing or damaged.
    """
    config, out, workers = AblationConfig.read(settings.config), settings.out, settings.workers
    claim(config, out)
    report_resume(config, out)
    runs = [run for path in config.pools for run in _runs(config, path, out, workers)]
    count = min(workers.count, len(runs))
    shares = [runs[first::count] for first in range(count)]
    work = partial(_run_all, config=config, out=out)
    parallel.run(work, shares, workers=workers, description="policies")
    cells = {cell: _read(cell.path(out)) for cell in all_cells(config)}
    write_text(out / "results.csv", as_csv(cells))
    table = as_markdown(config, cells)
    write_text(out / "results.md", table)
    return table


def claim(config: AblationConfig, out: Path) -> None:
    """Reserve the folder `out` for this ablation, or check that it already is.

    Raises:
        ConfigError: it is in use for something else.
    """
    record = json.loads(json.dumps(asdict(config), default=str))
    path = out / RECORD
    if not path.is_file():
        check_new_folder(out)
        (out / "cells").mkdir(parents=True, exist_ok=True)
        write_json(path, record)
    elif json.loads(path.read_text()) != record:
        raise ConfigError(
            f"The output folder '{out}' holds an ablation with other settings; choose a new one."
        )


def report_resume(config: AblationConfig, out: Path) -> None:
    """Say on stderr how many runs of an interrupted ablation are done, if any."""
    cells = all_cells(config)
    done = sum(cell.path(out).is_file() for cell in cells)
    if done == len(cells):
        print(f"All {done} runs are done.", file=sys.stderr)
    elif done:
        print(f"{done} of {len(cells)} runs are done; continuing.", file=sys.stderr)


def all_cells(config: AblationConfig) -> list[Cell]:
    """Every combination, in the order of the configuration."""
    return [cell for pool in config.pools for cell in _cells_of(config, pool)]


def chosen_weights(
    pool: Pool, variant: FilterVariant, out: Path, workers: Workers
) -> NDArray[np.float64]:
    """Weight of every demonstration of `pool`, (D,); a filter is run once and its table kept.

    Raises:
        ConfigError: nothing is left to learn from, or the pool has no labels for `labels`.
    """
    if variant.use == LABELS:
        return _labels(pool)
    if not variant.runs:
        return demo_weights(pool, None, "ignore")
    table = out / "filters" / f"{pool.root.name}--{variant.name}.csv"
    if not table.is_file():
        table.parent.mkdir(exist_ok=True)
        write_weight_table(table, DemoFilter(variant.config).fit(pool, workers=workers).table())
    return demo_weights(pool, table, variant.use)


def _cells_of(config: AblationConfig, pool: Path) -> list[Cell]:
    return [
        Cell(pool.name, variant.name, learner.name, seed)
        for variant in config.filters
        for learner in config.learners
        for seed in config.seeds
    ]


def _runs(config: AblationConfig, path: Path, out: Path, workers: Workers) -> list[Run]:
    """Return the cells of the pool at `path` that have no scores yet."""
    cells = [cell for cell in _cells_of(config, path) if not cell.path(out).is_file()]
    if not cells:
        return []
    pool = Pool.open(path)
    wanted = {cell.filter for cell in cells}
    weights = {
        variant.name: chosen_weights(pool, variant, out, workers)
        for variant in config.filters
        if variant.name in wanted
    }
    samples = load_decisions(pool, DemosConfig(observe=config.observe), workers=workers)
    experts = places_of(pool, config.expert)
    learners = {variant.name: variant for variant in config.learners}
    return [
        Run(cell, learners[cell.learner], samples, weights[cell.filter], experts) for cell in cells
    ]


def _run_all(runs: Sequence[Run], *, config: AblationConfig, out: Path) -> None:
    """Train and evaluate policies one after the other; shared decisions are simulated once."""
    with worlds(EnvironmentConfig(config.env_id, max_actions=config.max_actions)) as world:
        for run in runs:
            _run_cell(run, world, config, out)


def _run_cell(run: Run, world: World, config: AblationConfig, out: Path) -> None:
    """Train one policy, evaluate it, and write its scores."""
    cell, kind = run.cell, run.learner.kind
    needed: dict[str, Any] = {"experts": run.experts} if EXPERTS in kind.needs else {}
    learner = kind.make(seed=cell.seed, **run.learner.settings, **needed)
    policy = learner.fit(run.samples, run.weights).policy_
    seeds = range(config.first_seed, config.first_seed + config.episodes)
    played = play(world(policy.spec), policy, seeds)
    scores = {mode: score(mode, played[mode], policy.action_names) for mode in MODES}
    record = {
        **asdict(cell),
        "settings": asdict(learner.config),
        "actions": policy.action_names,
        "weights": run.weights.tolist(),
        "scores": as_json(scores),
    }
    write_json(cell.path(out), record)


def _read(path: Path) -> dict[str, Scores]:
    """Read the scores of a cell."""
    record = json.loads(path.read_text())
    return {
        mode: score(mode, [_episode(e) for e in found["episodes"]], record["actions"])
        for mode, found in record["scores"].items()
    }


def _episode(saved: dict[str, Any]) -> Episode:
    lists = {name: tuple(saved[name]) for name in ("subtasks_done", "violations")}
    return Episode(**(saved | lists | {"actions": tuple(Action(**a) for a in saved["actions"])}))


def _labels(pool: Pool) -> NDArray[np.float64]:
    records = [episode.record for episode in pool.episodes]
    if any(record is None for record in records):
        raise ConfigError(
            f"'{pool.root}' does not say which demonstrations are correct; "
            "leave out the filter with use 'labels'."
        )
    return np.array([float(record is not None and record.correct) for record in records])
