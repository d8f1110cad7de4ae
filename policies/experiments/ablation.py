"""Pools x filters x learners x seeds: what does choosing demonstrations do to a policy?

Every combination is a cell: a policy is trained and tried out on the same episodes as all others,
and its scores are kept in a file of their own. So an ablation that was interrupted goes on where it
stopped. The verdicts of a pool are read for the use `labels` alone.
"""

import csv
import io
import json
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
from policies.experiments.ablation_config import LABELS, AblationConfig, FilterVariant
from policies.learners.registry import find_learner
from policies.play.evaluation import MODES, Scores, World, play, score, worlds
from policies.play.results import as_json
from policies.play.rollout import Action, EnvironmentConfig, Episode
from policies.training import places_of
from teasim.common import parallel
from teasim.common.errors import ConfigError
from teasim.common.files import check_new_folder, write_json, write_text
from teasim.common.statistics import bootstrap_difference
from teasim.pool import Pool
from teasim.pool.weight_table import write_weight_table

RECORD = "ablation.json"


@dataclass(frozen=True)
class Cell:
    """One policy: where its demonstrations come from, and how it learns."""

    pool: str
    filter: str
    learner: str
    seed: int

    def path(self, out: Path) -> Path:
        """File of its scores."""
        return out / "cells" / f"{self.pool}--{self.filter}--{self.learner}--{self.seed}.json"


def run_ablation(config: AblationConfig, out: Path, *, jobs: int) -> str:
    """Do what is still to be done in the folder `out` and return the table of results.

    Writes `results.csv` (a row per cell and mode) and `results.md` (training seeds put together).

    Raises:
        ConfigError: `out` is in use for something else.
        PoolError: a pool is missing or damaged.
    """
    claim(config, out)
    todo = [each for path in config.pools for each in _todo(config, path, out, jobs)]
    shares = [todo[first::jobs] for first in range(min(jobs, len(todo)))]
    run = partial(_run_cells, config=config, out=out)
    parallel.run(run, shares, jobs=jobs, description="policies")
    cells = {cell: _read(cell.path(out)) for cell in all_cells(config)}
    write_text(out / "results.csv", as_csv(cells))
    table = as_markdown(config, cells)
    write_text(out / "results.md", table)
    return table


def claim(config: AblationConfig, out: Path) -> None:
    """Take the folder `out`, or find that it was taken for the same ablation.

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


def all_cells(config: AblationConfig) -> list[Cell]:
    """Every combination, in the order of the configuration."""
    return [cell for pool in config.pools for cell in _cells_of(config, pool)]


def chosen_weights(pool: Pool, variant: FilterVariant, out: Path, jobs: int) -> NDArray[np.float64]:
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
        write_weight_table(table, DemoFilter(variant.config).fit(pool, jobs=jobs).table())
    return demo_weights(pool, table, variant.use)


def as_csv(cells: dict[Cell, dict[str, Scores]]) -> str:
    """Write one row per cell and mode; rates with their 95 % intervals, in [0, 1]."""
    text = io.StringIO()
    rates = ("policy_accuracy", "lenient_accuracy", "success", "unsafe", "spills")
    heads = [f"{name}{end}" for name in rates for end in ("", "_low", "_high")]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["pool", "filter", "learner", "seed", "mode", "episodes", *heads])
    for cell, by_mode in cells.items():
        for mode, s in by_mode.items():
            found = [getattr(s, name) for name in rates]
            numbers = [f"{n:.4f}" for rate in found for n in (rate.value, rate.low, rate.high)]
            key = (cell.pool, cell.filter, cell.learner, cell.seed, mode, len(s.episodes))
            writer.writerow([*key, *numbers])
    return text.getvalue()


def as_markdown(config: AblationConfig, cells: dict[Cell, dict[str, Scores]]) -> str:
    """Write one table per mode, the training seeds of a row put together."""
    return "\n".join(_table(config, cells, mode) for mode in MODES)


def _table(config: AblationConfig, cells: dict[Cell, dict[str, Scores]], mode: str) -> str:
    base = config.filters[0].name
    heads = ["pool", "filter", "learner", "policy accuracy", "of each training seed"]
    heads += ["lenient", "goal reached", "oven left on", f"policy accuracy beside '{base}'"]
    lines = [f"## {mode} decisions, {config.episodes} episodes per policy", ""]
    lines += [_row(heads), _row(["---"] * len(heads))]
    for pool in config.pools:
        for learner in config.learners:
            rows = {
                variant.name: [
                    cells[Cell(pool.name, variant.name, learner, seed)][mode]
                    for seed in config.seeds
                ]
                for variant in config.filters
            }
            lines += [
                _row([pool.name, name, learner, *_numbers(found), _beside(found, rows[base])])
                for name, found in rows.items()
            ]
    return "\n".join([*lines, ""])


def _numbers(found: list[Scores]) -> list[str]:
    merged = score(found[0].mode, [e for s in found for e in s.episodes], ())
    seeds = ", ".join(f"{100 * s.policy_accuracy.value:.1f}" for s in found)
    rates = (merged.lenient_accuracy, merged.success, merged.unsafe)
    return [str(merged.policy_accuracy), seeds, *map(str, rates)]


def _beside(found: list[Scores], base: list[Scores]) -> str:
    if found is base:
        return ""
    return str(bootstrap_difference(_hits(found), _hits(base)))


def _hits(found: list[Scores]) -> list[tuple[int, int]]:
    """Correct and all actions per scene, over the training seeds: a scene is what is paired."""
    scenes = zip(*(s.episodes for s in found), strict=True)
    return [
        (sum(episode.n_correct for episode in scene), sum(len(e.actions) for e in scene))
        for scene in scenes
    ]


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cells_of(config: AblationConfig, pool: Path) -> list[Cell]:
    return [
        Cell(pool.name, variant.name, learner, seed)
        for variant in config.filters
        for learner in config.learners
        for seed in config.seeds
    ]


@dataclass(frozen=True)
class Todo:
    """A cell that is still to be done, and what its policy learns from."""

    cell: Cell
    samples: DecisionSamples
    weights: NDArray[np.float64]
    """(D,)"""
    experts: tuple[int, ...]


def _todo(config: AblationConfig, path: Path, out: Path, jobs: int) -> list[Todo]:
    """Look at the pool at `path`; return its cells that have no scores yet."""
    cells = [cell for cell in _cells_of(config, path) if not cell.path(out).is_file()]
    if not cells:
        return []
    pool = Pool.open(path)
    wanted = {cell.filter for cell in cells}
    weights = {
        variant.name: chosen_weights(pool, variant, out, jobs)
        for variant in config.filters
        if variant.name in wanted
    }
    samples = load_decisions(pool, DemosConfig(observe=config.observe), jobs=jobs)
    experts = places_of(pool, config.expert)
    return [Todo(cell, samples, weights[cell.filter], experts) for cell in cells]


def _run_cells(work: Sequence[Todo], *, config: AblationConfig, out: Path) -> None:
    """Train and try out policies one after the other; what they do alike is simulated once."""
    with worlds(EnvironmentConfig(config.env_id, max_actions=config.max_actions)) as world:
        for todo in work:
            _run_cell(todo, world, config, out)


def _run_cell(todo: Todo, world: World, config: AblationConfig, out: Path) -> None:
    """Train one policy, try it out, keep its scores."""
    cell, weights = todo.cell, todo.weights
    kind = find_learner(cell.learner, "subtask")
    settings: dict[str, Any] = {"experts": todo.experts} if kind.takes_experts else {}
    policy = kind.make(seed=cell.seed, **settings).fit(todo.samples, weights).policy_
    seeds = range(config.first_seed, config.first_seed + config.episodes)
    played = play(world(policy.spec), policy, seeds)
    scores = {mode: score(mode, played[mode], policy.action_names) for mode in MODES}
    record = {**asdict(cell), "actions": policy.action_names, "weights": weights.tolist()}
    write_json(cell.path(out), record | {"scores": as_json(scores)})


def _read(path: Path) -> dict[str, Scores]:
    """Read the scores of a cell back."""
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
