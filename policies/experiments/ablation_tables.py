"""Results of an ablation: rows of cells and of filters, tables and figures of pooled seeds."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from policies.experiments.ablation_config import AblationConfig
from policies.experiments.detection import DetectionScores, Judged, detection_scores
from policies.experiments.playing import (
    AnyScores,
    hits_by_policy,
    hits_by_scene,
    main_rate,
    merged,
)
from policies.experiments.tabular import html_page, html_table, markdown_table, write_rows
from policies.experiments.variants import LearnerVariant
from policies.play.evaluation import MODES, Scores
from teasim.common.figures import AccuracyFigure, Drawing
from teasim.common.figures.accuracy import Point
from teasim.common.files import write_text
from teasim.common.statistics import (
    Difference,
    Rate,
    bootstrap_difference,
    grouped_rate,
    rate,
    widest,
)

GROUPINGS = (hits_by_scene, hits_by_policy)
"""Trials that may be correlated; an interval is the wider one."""
ENDS = ("", "_low", "_high")
"""Ends of the names of the three columns of a rate."""


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


Cells = Mapping[Cell, Mapping[str, AnyScores]]
"""Scores by mode of every cell."""
Detection = dict[tuple[str, str], Judged]
"""What was said by pool and filter, where the pool has labels."""


@dataclass(frozen=True)
class Found:
    """What an ablation found."""

    cells: Cells
    """Scores of the policies."""
    detection: Detection
    """What the filters said."""

    @property
    def kinds(self) -> list[str]:
        """Kinds of violation, in the environments' words."""
        return list(dict.fromkeys(kind for s in self._scores() for kind in s.violations))

    @property
    def incorrect(self) -> dict[str, int]:
        """Number K of demonstrations labelled incorrect, by pool; only of pools with labels."""
        return {pool: sum(judged.wrong) for (pool, _), judged in self.detection.items()}

    @property
    def measure(self) -> str:
        """Name of what `main_rate` returns for these cells."""
        over_steps = {isinstance(s, Scores) for s in self._scores()}
        names = {True: "policy accuracy", False: "sub-tasks done"}
        return " or ".join(names[kind] for kind in sorted(over_steps, reverse=True))

    @property
    def modes(self) -> list[str]:
        """Modes in which any policy decides; one that draws nothing has no sampled decisions."""
        return [mode for mode in MODES if any(mode in by_mode for by_mode in self.cells.values())]

    def learners(self, config: AblationConfig, mode: str) -> list[LearnerVariant]:
        """Return the learners of `config` whose policies decide in `mode`."""
        used = {cell.learner for cell, by_mode in self.cells.items() if mode in by_mode}
        return [learner for learner in config.learners if learner.name in used]

    def _scores(self) -> Iterator[AnyScores]:
        return (s for by_mode in self.cells.values() for s in by_mode.values())

    def scores_of(self, pool: str, name: str) -> DetectionScores | None:
        """Return how well a filter detects in a pool; None where that is not known."""
        judged = self.detection.get((pool, name))
        return None if judged is None else detection_scores([judged])


def write_results(config: AblationConfig, found: Found, out: Path) -> str:
    """Write all files and return the text of results.md."""
    write_rows(out, "results", result_rows(config, found))
    write_rows(out, "detection", detection_rows(found))
    tables = tables_of(config, found)
    text = "\n".join(f"## {title}\n\n{markdown_table(rows)}" for title, rows in tables.items())
    write_text(out / "results.md", text)
    parts = [f"<h2>{escape(title)}</h2>{html_table(rows)}" for title, rows in tables.items()]
    write_text(out / "results.html", html_page("Ablation", parts))
    return text


def result_rows(config: AblationConfig, found: Found) -> list[dict[str, Any]]:
    """Return a row per cell and mode; rates in [0, 1] with their 95 % intervals.

    Each kind of violation has columns of its own, named in the environment's words. Differences are
    those to the first filter, in the same episodes and with the same training seed.
    """
    rows = []
    for key, by_mode in found.cells.items():
        detected = found.scores_of(key.pool, key.filter)
        base = found.cells[Cell(key.pool, config.filters[0].name, key.learner, key.seed)]
        for mode, s in by_mode.items():
            violated = {kind.replace(" ", "_"): _violation(s, kind) for kind in found.kinds}
            rates = _rates(s) | violated
            change = bootstrap_difference(hits_by_scene([s]), hits_by_scene([base[mode]]))
            rows.append(
                {
                    **vars(key),
                    "mode": mode,
                    "episodes": len(s.episodes),
                    **_spread(rates),
                    "difference": change.value,
                    "difference_low": change.low,
                    "difference_high": change.high,
                    "flagging_recall": detected and detected.recall.value,
                    "flagging_false_alarms": detected and detected.false_alarms.value,
                    "flagging_auroc": detected and detected.auroc,
                    "flagging_brier": detected and detected.brier,
                }
            )
    return rows


def detection_rows(found: Found) -> list[dict[str, Any]]:
    """Return a row per pool and filter; rates in [0, 1] with their 95 % intervals."""
    rows = []
    for (pool, name), judged in found.detection.items():
        s = detection_scores([judged])
        rates = {name: getattr(s, name) for name in ("recall", "false_alarms", "precision")}
        rows.append(
            {
                "pool": pool,
                "filter": name,
                "incorrect": sum(judged.wrong),
                "correct": len(judged.wrong) - sum(judged.wrong),
                "flagged": sum(judged.flagged),
                **_spread(rates | {"accuracy": s.accuracy}),
                "f1": s.f1,
                "auroc": s.auroc,
                "brier": s.brier,
            }
        )
    return rows


def tables_of(config: AblationConfig, found: Found) -> dict[str, list[dict[str, Any]]]:
    """Return the tables to read, by title."""
    tables = by_number(config, found) | {
        f"{mode} decisions, {config.episodes} episodes per policy": _table(config, found, mode)
        for mode in found.modes
    }
    rows = [
        {
            "pool": pool,
            "filter": name,
            "incorrect found": str(s.recall),
            "correct ones accused": str(s.false_alarms),
            "AUROC": s.auroc,
            "Brier": s.brier,
        }
        for (pool, name), judged in found.detection.items()
        for s in [detection_scores([judged])]
    ]
    return tables | {"detection": rows} if rows else tables


def by_number(config: AblationConfig, found: Found) -> dict[str, list[dict[str, Any]]]:
    """Return a table per mode over the number K of incorrect demonstrations, pools pooled.

    None where no two pools have the same K. Intervals are the wider one of two: with each scene,
    and with each policy, as a group of correlated trials.
    """
    incorrect = found.incorrect
    if len(incorrect) == len(set(incorrect.values())):
        return {}
    return {
        f"{mode} decisions, by incorrect demonstrations": [
            {
                "incorrect": k,
                "pools": list(incorrect.values()).count(k),
                "filter": variant.name,
                "learner": learner.name,
                **_pooled(config, found, (variant.name, learner.name, mode), k),
            }
            for k in sorted(set(incorrect.values()))
            for learner in found.learners(config, mode)
            for variant in config.filters
        ]
        for mode in found.modes
    }


def _pooled(
    config: AblationConfig, found: Found, key: tuple[str, str, str], k: int
) -> dict[str, Any]:
    """Return what a row says about a filter, learner and mode over all pools of K and seeds."""
    base = config.filters[0].name
    mine = _scores(config, found, key, k)
    theirs = _scores(config, found, (base, *key[1:]), k)
    sizes = [
        sum(judged.flagged)
        for (pool, name), judged in found.detection.items()
        if name == key[0] and found.incorrect[pool] == k
    ]
    return {
        "left out": ", ".join(map(str, sizes)),
        found.measure: str(_wide_rate(mine)),
        "goal reached": str(merged(mine).success),
        f"{found.measure} against '{base}'": None if key[0] == base else str(_gap(mine, theirs)),
    }


def _wide_rate(scores: list[AnyScores]) -> Rate:
    """Return the rate of several policies; a single one says nothing of how policies differ."""
    groupings = GROUPINGS if len(scores) > 1 else GROUPINGS[:1]
    return widest([grouped_rate(by(scores)) for by in groupings])


def _gap(mine: list[AnyScores], theirs: list[AnyScores]) -> Difference:
    """Return the difference of the same policies' scores, with the wider interval."""
    gaps = [bootstrap_difference(by(mine), by(theirs)) for by in GROUPINGS]
    return Difference(gaps[0].value, min(g.low for g in gaps), max(g.high for g in gaps))


def _table(config: AblationConfig, found: Found, mode: str) -> list[dict[str, Any]]:
    rows = []
    for pool in config.pools:
        for learner in found.learners(config, mode):
            by_filter = {
                variant.name: [
                    found.cells[Cell(pool.name, variant.name, learner.name, seed)][mode]
                    for seed in config.seeds
                ]
                for variant in config.filters
            }
            for name, scores in by_filter.items():
                keys = {"pool": pool.name, "filter": name, "learner": learner.name}
                rows.append(keys | _cells(found, scores, by_filter))
    return rows


def _cells(
    found: Found, scores: list[AnyScores], by_filter: Mapping[str, list[AnyScores]]
) -> dict[str, Any]:
    """Return what a row of a table says about the policies of all training seeds."""
    base, first = next(iter(by_filter.items()))
    whole = merged(scores)
    return {
        found.measure: str(main_rate(whole)),
        "of each training seed": ", ".join(f"{100 * main_rate(s).value:.1f}" for s in scores),
        "lenient": str(whole.lenient_accuracy) if isinstance(whole, Scores) else None,
        "goal reached": str(whole.success),
        **{kind: str(_violation(whole, kind)) for kind in found.kinds},
        f"{found.measure} against '{base}'": None
        if scores is first
        else str(bootstrap_difference(hits_by_scene(scores), hits_by_scene(first))),
    }


def _rates(scores: AnyScores) -> dict[str, Rate | None]:
    over_steps = isinstance(scores, Scores)
    return {
        "policy_accuracy": scores.policy_accuracy if isinstance(scores, Scores) else None,
        "lenient_accuracy": scores.lenient_accuracy if isinstance(scores, Scores) else None,
        "subtasks_done": None if over_steps else main_rate(scores),
        "success": scores.success,
    }


def _spread(rates: Mapping[str, Rate | None]) -> dict[str, float | None]:
    """Return three columns per rate."""
    columns: dict[str, float | None] = {}
    for name, r in rates.items():
        numbers = (r.value, r.low, r.high) if r else (None, None, None)
        columns |= {f"{name}{end}": n for end, n in zip(ENDS, numbers, strict=True)}
    return columns


def _violation(scores: AnyScores, kind: str) -> Rate:
    """Rate of a kind of violation; 0 where it never occurred and the environment names none."""
    return scores.violations.get(kind) or rate(0, len(scores.episodes))


def ablation_figures(config: AblationConfig, found: Found) -> dict[str, Drawing]:
    """Return a figure per mode; none where no pool has labels, because K is not known then.

    Pools with the same K and training seeds are pooled.
    """
    incorrect = found.incorrect
    if not incorrect:
        return {}
    return {
        f"accuracy_{mode}": AccuracyFigure(
            {
                _name(config, variant.name, learner.name): tuple(
                    _point(config, found, (variant.name, learner.name, mode), k)
                    for k in sorted(set(incorrect.values()))
                )
                for variant in config.filters
                for learner in found.learners(config, mode)
            },
            found.measure,
        )
        for mode in found.modes
    }


def _name(config: AblationConfig, variant: str, learner: str) -> str:
    return variant if len(config.learners) == 1 else f"{learner}, {variant}"


def _point(config: AblationConfig, found: Found, key: tuple[str, str, str], k: int) -> Point:
    scores = _scores(config, found, key, k)
    share = _wide_rate(scores)
    return Point(k, share.value, share.low, share.high)


def _scores(
    config: AblationConfig, found: Found, key: tuple[str, str, str], k: int
) -> list[AnyScores]:
    """Return the scores of a filter, learner and mode, a policy per pool of K and seed."""
    variant, learner, mode = key
    return [
        found.cells[Cell(pool, variant, learner, seed)][mode]
        for pool, number in found.incorrect.items()
        if number == k
        for seed in config.seeds
    ]
