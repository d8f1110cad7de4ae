"""Figure 6: policy accuracy over the number of incorrect demonstrations, filtered or not."""

import math
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq

from filtering.config import FilterConfig
from policies.experiments.ablation import run_plan
from policies.experiments.ablation_config import AblationConfig
from policies.experiments.ablation_tables import ENDS
from policies.experiments.reproduce.exhibits.exhibit import Exhibit, Table
from policies.experiments.reproduce.paper import CORRECT
from policies.experiments.reproduce.plan import (
    FILMED,
    FIRST_SEED,
    PEOPLE_LEVEL,
    SECONDS_PER_DEMO,
    SECONDS_PER_EPISODE,
    SECONDS_PER_VIDEO,
    SEGMENTERS,
    Plan,
)
from policies.experiments.units import Result, Store, Unit
from policies.experiments.variants import FilterVariant, LearnerVariant, PoolVariant
from policies.play.evaluation import MODES
from teasim.common.figures import AccuracyFigure
from teasim.common.figures.accuracy import Point
from teasim.common.workers import Workers

LEARNERS = ("bc", "bc-rnn", "demodice", "r-maxent")
"""Learners of the figure."""
DRAWN = ("bc", "bc-rnn")
"""Learners that are drawn."""
UNFILTERED, FILTERED = "all", "filtered"
"""Training sets of the figure: all demonstrations, and those that the filter does not flag."""
OBSERVE = "pixels_agent_pos"
"""What the policies see: pictures of the cameras, and the joint positions."""
CAMERAS = ("left", "cup")
"""Cameras that film the pools; what is in the cup shows in the second one."""
EXPERTS = 2
"""Demonstrations that DemoDICE is told to be good, the first that are labelled correct."""
POOL_SEED = FIRST_SEED + 100
"""Seed of the pool without incorrect demonstrations; K is added, so that no bank has the same."""


def units(plan: Plan) -> dict[int, Unit]:
    """Return the unit of each number K of incorrect demonstrations."""
    return {k: _unit(plan, k) for k in plan.size.incorrect}


def _unit(plan: Plan, k: int) -> Unit:
    size = plan.size
    seed = POOL_SEED + 100 * plan.seed + k
    pool = {"seq1": CORRECT, "seq3": k, **FILMED, "camera": list(CAMERAS), "seed": seed}
    spec = {
        "pool": pool,
        "learners": list(LEARNERS),
        "seeds": list(range(size.training_seeds)),
        "episodes": size.episodes,
        "experts": EXPERTS,
        "observe": OBSERVE,
    }
    policies = 3 * len(LEARNERS) * size.training_seeds
    seconds = (CORRECT + k) * (SECONDS_PER_DEMO + SECONDS_PER_VIDEO)
    seconds += policies * len(MODES) * size.episodes * SECONDS_PER_EPISODE / 2
    return Unit("policies", spec, plan.segmenter(PEOPLE_LEVEL), seconds, wide=True)


def run_policies(unit: Unit, store: Store, workers: Workers) -> Result:
    """Filter a pool from its videos, and train and score all policies; resumed policy by policy."""
    out = store.folder_of(unit)
    run_plan(config_of(unit, store.folder_of(unit.needs["network"])), out, workers)
    return {name: _plain(out / f"{name}.parquet") for name in ("results", "detection")}


def config_of(unit: Unit, network: Path) -> AblationConfig:
    """Return the ablation of a unit, whose filter segments by `network`."""
    spec = unit.spec
    return AblationConfig(
        pools=(PoolVariant("pool", options=spec["pool"]),),
        filters=(
            FilterVariant(UNFILTERED, "ignore"),
            FilterVariant(
                FILTERED, "discard", FilterConfig(segmenter=str(network), cameras=CAMERAS[:1])
            ),
            FilterVariant("oracle", "labels"),
        ),
        learners=tuple(LearnerVariant(name, name) for name in spec["learners"]),
        seeds=tuple(spec["seeds"]),
        experts=spec["experts"],
        observe=spec["observe"],
        episodes=spec["episodes"],
    )


def _plain(path: Path) -> list[dict[str, Any]]:
    """Return the rows of a Parquet file, None in place of nan."""
    return [
        {
            name: None if isinstance(value, float) and math.isnan(value) else value
            for name, value in row.items()
        }
        for row in pq.read_table(path).to_pylist()
    ]


def table(plan: Plan, store: Store) -> Table:
    """Return a row per K, learner, training set, mode and training seed."""
    rows: list[dict[str, Any]] = []
    words = []
    for k, unit in units(plan).items():
        found = store.read(unit)
        rows += [
            {
                "incorrect": k,
                "learner": row["learner"],
                "trained on": row["filter"],
                "decisions": row["mode"],
                "training seed": row["seed"],
                "episodes": row["episodes"],
                **{name: row[name] for name in row if name.startswith("policy_accuracy")},
                **{name: row[name] for name in row if name.startswith("difference")},
                "goal reached": row["success"],
            }
            for row in found["results"]
        ]
        flagged = next(row for row in found["detection"] if row["filter"] == FILTERED)
        words.append(
            f"{CORRECT} + {k}: the filter found {flagged['recall']:.0%} of the incorrect and "
            f"accused {flagged['false_alarms']:.0%} of the correct demonstrations."
        )
    words += [_sentence(rows, learner, mode) for learner in LEARNERS for mode in MODES]
    note = (
        f"Ours judges the videos by segments of {SEGMENTERS[PEOPLE_LEVEL]}; policies learn the "
        "next sub-task from pictures, joint positions and the logged sub-tasks. Differences are to "
        "all demonstrations, in the same scenes, with 95 % intervals. The oracle leaves out what "
        "is labelled incorrect."
    )
    figures = {f"{mode} decisions": _figure(rows, mode) for mode in MODES}
    return Table(rows, words, notes=(note,), figures=figures)


def _figure(rows: list[dict[str, Any]], mode: str) -> AccuracyFigure:
    """Draw the means over the training seeds of the cloned policies, as in the paper."""
    series: dict[str, tuple[Point, ...]] = {}
    for learner in DRAWN:
        for name in (UNFILTERED, FILTERED):
            mine = [
                row
                for row in rows
                if (row["learner"], row["trained on"], row["decisions"]) == (learner, name, mode)
            ]
            numbers = sorted({row["incorrect"] for row in mine})
            series[f"{learner}, {name}"] = tuple(
                Point(k, *_means([row for row in mine if row["incorrect"] == k])) for k in numbers
            )
    return AccuracyFigure(series)


def _means(rows: list[dict[str, Any]]) -> tuple[float, float, float]:
    """Return the mean policy accuracy of some rows, and the means of the ends of its interval."""
    value, low, high = (
        sum(row[f"policy_accuracy{end}"] for row in rows) / len(rows) for end in ENDS
    )
    return value, low, high


def _sentence(rows: list[dict[str, Any]], learner: str, mode: str) -> str:
    """Write what filtering changed for a learner at the largest K."""
    k = max(row["incorrect"] for row in rows)
    mine = [
        row
        for row in rows
        if (row["incorrect"], row["learner"], row["decisions"]) == (k, learner, mode)
    ]

    def mean(name: str, column: str) -> float:
        found = [row[column] for row in mine if row["trained on"] == name]
        return 100 * sum(found) / len(found)

    low, high = (mean(FILTERED, f"difference_{end}") for end in ("low", "high"))
    verdict = "helps" if low > 0 else "harms" if high < 0 else "makes no difference that shows"
    on_all, filtered, oracle = (
        f"{mean(name, 'policy_accuracy'):.1f} %" for name in (UNFILTERED, FILTERED, "oracle")
    )
    return (
        f"{learner}, {mode} decisions, {CORRECT} + {k}: policy accuracy {on_all} on all, "
        f"{filtered} filtered ({low:+.1f} to {high:+.1f} points), {oracle} without what is "
        f"labelled incorrect: filtering {verdict}."
    )


FIGURE_6 = Exhibit(
    "policy accuracy over the number of incorrect demonstrations",
    "several learners learn a better policy when incorrect demonstrations are discarded; the "
    "figure's numbers are not in the text that was available.",
    lambda plan: list(units(plan).values()),
    table,
)
