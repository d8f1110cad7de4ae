"""Results of an ablation: a CSV row per cell and mode, and Markdown tables of pooled seeds."""

import csv
import io
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from policies.experiments.ablation_config import AblationConfig
from policies.play.evaluation import MODES, Scores, score
from teasim.common.statistics import Rate, bootstrap_difference, rate


@dataclass(frozen=True)
class Cell:
    """One combination of an ablation."""

    pool: str
    """Name of the pool."""
    filter: str
    """Name of the filter variant."""
    learner: str
    """Name of the learner variant."""
    seed: int
    """Seed of the learner."""

    def path(self, out: Path) -> Path:
        """File of its scores in the output folder."""
        return out / "cells" / f"{self.pool}--{self.filter}--{self.learner}--{self.seed}.json"


Cells = Mapping[Cell, Mapping[str, Scores]]
"""Scores by mode of every cell."""


def as_csv(cells: Cells) -> str:
    """Write one row per cell and mode; rates with their 95 % intervals, in [0, 1].

    Each kind of violation has columns of its own, named in the environment's words.
    """
    rows = [(cell, mode, s) for cell, by_mode in cells.items() for mode, s in by_mode.items()]
    kinds = dict.fromkeys(kind for _, _, s in rows for kind in s.violations)
    names = ["policy_accuracy", "lenient_accuracy", "success"]
    names += [kind.replace(" ", "_") for kind in kinds]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    heads = [f"{name}{end}" for name in names for end in ("", "_low", "_high")]
    writer.writerow(["pool", "filter", "learner", "seed", "mode", "episodes", *heads])
    for cell, mode, s in rows:
        found = [s.policy_accuracy, s.lenient_accuracy, s.success]
        found += [_violation(s, kind) for kind in kinds]
        numbers = [f"{n:.4f}" for r in found for n in (r.value, r.low, r.high)]
        key = (cell.pool, cell.filter, cell.learner, cell.seed, mode, len(s.episodes))
        writer.writerow([*key, *numbers])
    return text.getvalue()


def as_markdown(config: AblationConfig, cells: Cells) -> str:
    """Write one table per mode, with the training seeds of a row pooled."""
    return "\n".join(_table(config, cells, mode) for mode in MODES)


def _table(config: AblationConfig, cells: Cells, mode: str) -> str:
    base = config.filters[0].name
    kinds = list(dict.fromkeys(k for by_mode in cells.values() for k in by_mode[mode].violations))
    heads = ["pool", "filter", "learner", "policy accuracy", "of each training seed"]
    heads += ["lenient", "goal reached", *kinds, f"policy accuracy against '{base}'"]
    lines = [f"## {mode} decisions, {config.episodes} episodes per policy", ""]
    lines += [_row(heads), _row(["---"] * len(heads))]
    for pool in config.pools:
        for learner in config.learners:
            rows = {
                variant.name: [
                    cells[Cell(pool.name, variant.name, learner.name, seed)][mode]
                    for seed in config.seeds
                ]
                for variant in config.filters
            }
            lines += [
                _row([pool.name, name, learner.name, *_numbers(s, kinds), _against(s, rows[base])])
                for name, s in rows.items()
            ]
    return "\n".join([*lines, ""])


def _numbers(found: list[Scores], kinds: list[str]) -> list[str]:
    merged = score(found[0].mode, [e for s in found for e in s.episodes], ())
    seeds = ", ".join(f"{100 * s.policy_accuracy.value:.1f}" for s in found)
    violations = (_violation(merged, kind) for kind in kinds)
    rates = (merged.lenient_accuracy, merged.success, *violations)
    return [str(merged.policy_accuracy), seeds, *map(str, rates)]


def _violation(scores: Scores, kind: str) -> Rate:
    """Rate of a kind of violation; 0 where it never occurred and the environment names none."""
    return scores.violations.get(kind) or rate(0, len(scores.episodes))


def _against(found: list[Scores], base: list[Scores]) -> str:
    if found is base:
        return ""
    return str(bootstrap_difference(_hits(found), _hits(base)))


def _hits(found: list[Scores]) -> list[tuple[int, int]]:
    """Correct and all actions per scene, over the training seeds: scenes are the pairs."""
    scenes = zip(*(s.episodes for s in found), strict=True)
    return [
        (sum(episode.n_correct for episode in scene), sum(len(e.actions) for e in scene))
        for scene in scenes
    ]


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"
