"""Ablations: pools x filters x learners x seeds, each combination trained and evaluated.

Each combination is a cell. All policies run in the same episodes, and the scores of a cell are kept
in a file of its own, so an interrupted ablation can be resumed. The labels of a pool are read to
score the filters, for the uses `labels`, `random` and `length`, and for `experts`.
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

from policies.data.demos import DemosConfig
from policies.experiments.ablation_config import AblationConfig
from policies.experiments.ablation_tables import (
    Cell,
    Detection,
    Found,
    ablation_figures,
    write_results,
)
from policies.experiments.choosing import Chooser, labels_of
from policies.experiments.generating import generate_pool
from policies.experiments.playing import AnyScores, play_cell, scores_from_json, scores_json
from policies.experiments.units import versions
from policies.experiments.variants import LearnerVariant, PoolVariant
from policies.learners.registry import EXPERTS
from policies.play.environments import World, worlds
from policies.settings import AblateSettings, EnvironmentConfig
from policies.training import LEVELS, places_of
from teasim.common import parallel
from teasim.common.errors import ConfigError
from teasim.common.figures import check_figures, save_figures
from teasim.common.files import check_new_folder, write_json
from teasim.common.workers import Workers
from teasim.pool import Pool

RECORD = "ablation.json"
"""File that says what ablation a folder is for."""


@dataclass(frozen=True)
class Run:
    """A cell that has no scores yet, and what its policy learns from."""

    cell: Cell
    """The cell."""
    same: tuple[Cell, ...]
    """Cells whose filters left the same training set, so that their scores are the same."""
    learner: LearnerVariant
    """The learner and its settings."""
    samples: Any
    """What its level learns from: decisions or control steps of the pool."""
    weights: NDArray[np.float64]
    """Weight of each demonstration.  # (D,)"""
    experts: tuple[int, ...]
    """Places in the pool of demonstrations known to be good."""


def run_ablation(settings: AblateSettings) -> str:
    """Run what has no scores yet and return the tables of results.

    Writes results (a row per cell and mode) and detection (a row per pool and filter) as CSV and
    Parquet, and both as tables in results.md and results.html, training seeds pooled.

    Raises:
        ConfigError: the configuration is unusable, or the output folder is in use.
        PoolError: a pool is missing or damaged.
    """
    config = AblationConfig.read(settings.config)
    return run_plan(config, settings.out, settings.workers, settings.figures)


def run_plan(
    config: AblationConfig, out: Path, workers: Workers, figures: Path | None = None
) -> str:
    """Run an ablation and draw its figures, if there is a folder for them; see `run_ablation`."""
    check_figures(figures)
    claim(config, out)
    report_resume(config, out)
    pools = [open_pool(variant, out, workers) for variant in config.pools]
    choosers = [
        chooser_of(config, pool, variant.name, out, workers)
        for pool, variant in zip(pools, config.pools, strict=True)
    ]
    runs = [run for chooser in choosers for run in _runs(config, chooser)]
    count = min(workers.count, len(runs))
    shares = [runs[first::count] for first in range(count)]
    work = partial(_run_all, config=config, out=out)
    parallel.run(work, shares, workers=workers, description="policies")
    found = results_of(config, choosers, out)
    if figures is not None:
        save_figures(figures, ablation_figures(config, found))
    return write_results(config, found, out)


def results_of(config: AblationConfig, choosers: Sequence[Chooser], out: Path) -> Found:
    """Read the scores of every cell, and score every filter whose pool has labels."""
    cells = {cell: _read(cell.path(out)) for cell in all_cells(config)}
    detection: Detection = {}
    for chooser in choosers:
        for variant in config.filters:
            judged = chooser.judged(variant)
            if judged is not None:
                detection[chooser.name, variant.name] = judged
    return Found(cells, detection)


def open_pool(variant: PoolVariant, out: Path, workers: Workers) -> Pool:
    """Open a pool, or make it in the output folder of the ablation; keep the part asked for.

    Raises:
        ConfigError: it has fewer incorrect demonstrations than asked for, or no labels.
    """
    if variant.folder is not None:
        pool = Pool.open(variant.folder)
    else:
        pool = generate_pool(out / "pools" / variant.name, variant.options, workers)
    if variant.incorrect is None:
        return pool
    wrong = labels_of(pool)
    if wrong.sum() < variant.incorrect:
        raise ConfigError(
            f"'{pool.root}' has {wrong.sum()} demonstrations labelled incorrect, fewer than "
            f"'incorrect' of the pool '{variant.name}', {variant.incorrect}."
        )
    kept = ~wrong | (np.cumsum(wrong) <= variant.incorrect)
    return pool.only(np.flatnonzero(kept).tolist())


def chooser_of(
    config: AblationConfig, pool: Pool, name: str, out: Path, workers: Workers
) -> Chooser:
    """Return what runs the filters of the configuration on a pool."""
    filters = {variant.name: variant for variant in config.filters}
    return Chooser(pool, name, filters, out, config.home, workers)


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
    return [cell for pool in config.pools for cell in _cells_of(config, pool.name)]


def _cells_of(config: AblationConfig, pool: str) -> list[Cell]:
    return [
        Cell(pool, variant.name, learner.name, seed)
        for variant in config.filters
        for learner in config.learners
        for seed in config.seeds
    ]


def _runs(config: AblationConfig, chooser: Chooser) -> list[Run]:
    """Return the cells of a pool that have no scores yet."""
    cells = [c for c in _cells_of(config, chooser.name) if not c.path(chooser.out).is_file()]
    if not cells:
        return []
    weights = {
        name: chooser.weights(chooser.filters[name])
        for name in dict.fromkeys(cell.filter for cell in cells)
    }
    learners = {variant.name: variant for variant in config.learners}
    wanted = dict.fromkeys(learners[cell.learner].level for cell in cells)
    demos = DemosConfig(observe=config.observe)
    samples = {
        level: LEVELS[level].load(chooser.pool, demos, workers=chooser.workers) for level in wanted
    }
    experts = _experts(config, chooser)
    alike: dict[tuple[str, int, bytes], list[Cell]] = {}
    for cell in cells:
        key = (cell.learner, cell.seed, weights[cell.filter].tobytes())
        alike.setdefault(key, []).append(cell)
    return [
        Run(
            cell,
            tuple(others),
            learners[cell.learner],
            samples[learners[cell.learner].level],
            weights[cell.filter],
            experts,
        )
        for cell, *others in alike.values()
    ]


def _experts(config: AblationConfig, chooser: Chooser) -> tuple[int, ...]:
    if not config.experts:
        return places_of(chooser.pool, config.expert)
    good = np.flatnonzero(~chooser.labels())
    if len(good) < config.experts:
        raise ConfigError(
            f"'{chooser.pool.root}' has {len(good)} demonstrations labelled correct, fewer than "
            f"'experts', {config.experts}."
        )
    return tuple(good[: config.experts].tolist())


def _run_all(runs: Sequence[Run], *, config: AblationConfig, out: Path) -> None:
    """Train and evaluate policies one after the other; shared decisions are simulated once."""
    with worlds(EnvironmentConfig(config.env_id, max_actions=config.max_actions)) as world:
        for run in runs:
            _run_cell(run, world, config, out)


def _run_cell(run: Run, world: World, config: AblationConfig, out: Path) -> None:
    """Train one policy, evaluate it, and write its scores, also for the cells that are the same."""
    cell, kind = run.cell, run.learner.kind
    needed: dict[str, Any] = {"experts": run.experts} if EXPERTS in kind.needs else {}
    learner = kind.make(seed=cell.seed, **run.learner.settings, **needed)
    policy = learner.fit(run.samples, run.weights).policy_
    played = play_cell(policy, run.learner.level, config, world)
    record = {
        "level": run.learner.level,
        "settings": asdict(learner.config),
        "actions": policy.action_names,
        "weights": run.weights.tolist(),
        "versions": versions(),
        "scores": scores_json(played),
    }
    for one in (cell, *run.same):
        write_json(one.path(out), asdict(one) | record)


def _read(path: Path) -> dict[str, AnyScores]:
    """Read the scores of a cell."""
    return scores_from_json(json.loads(path.read_text()))
