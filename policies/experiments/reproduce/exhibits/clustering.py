"""Appendix E: detection against the quality of segmentation, and by the clustering of weights.

The quality is not set: networks are fitted to fewer and fewer labelled videos, or to people, and
their share of right frames is measured. Nothing is made worse by hand. The default filter stands
beside them; it needs no network.
"""

from dataclasses import replace
from typing import Any

from policies.experiments.detection import detection_scores
from policies.experiments.reproduce.exhibits.detecting import (
    INTERVALS,
    judged_by,
    pools_unit,
    score_cells,
)
from policies.experiments.reproduce.exhibits.exhibit import Exhibit, Table
from policies.experiments.reproduce.exhibits.segmenting import frame_rate
from policies.experiments.reproduce.methods import LEARNED, NORM, OURS, THRESHOLDS
from policies.experiments.reproduce.plan import ROBOT_LEVEL, UNLABELLED, Plan
from policies.experiments.units import Store, Unit
from teasim.common.figures import AccuracyFigure, Drawing
from teasim.common.figures.accuracy import Point

KINDS: dict[str, tuple[int, tuple[tuple[str, int], ...]]] = {
    "10 Seq_1 + 4 Seq_2": (300, (("seq_1", 10), ("seq_2", 4))),
    "10 Seq_1 + 4 Seq_3": (301, (("seq_1", 10), ("seq_3", 4))),
}
"""Pools, with the number from which they are drawn."""
METHODS = (NORM, LEARNED, *(f"equation 3, {name}" for name in THRESHOLDS))
"""Methods of the work `thresholds` on the segments of a network."""
RIGHT = "frames right [%]"
"""Column of the quality of segmentation; empty for the default filter."""


def networks(plan: Plan) -> dict[str, Unit]:
    """Return the networks, from the fewest labelled videos to the most, then that of people."""
    few = {f"{n} of the robot": plan.network("taught", n) for n in plan.size.ladder}
    both = {"all of the robot": plan.network("taught"), "people": plan.network("people")}
    return {**few, **both}


def pairs(plan: Plan) -> dict[tuple[str, str], tuple[Unit, Unit]]:
    """Return by network and pool the units that score its segments, and what is made of them."""
    found = {}
    for name, network in networks(plan).items():
        for pool, (row, kinds) in KINDS.items():
            drawn = pools_unit(plan, kinds, ROBOT_LEVEL, row=row, work="thresholds")
            judged = replace(drawn, needs={**drawn.needs, "network": network})
            found[name, pool] = (plan.tested("robot", network), judged)
    return found


def alone(plan: Plan) -> dict[str, Unit]:
    """Return by pool the unit in which the default filter judges, without a network."""
    return {
        pool: pools_unit(plan, kinds, UNLABELLED, row=row, work="thresholds")
        for pool, (row, kinds) in KINDS.items()
    }


def table(plan: Plan, store: Store) -> Table:
    """Return a row per network, pool and method, in the order of the right frames."""
    rows: list[dict[str, Any]] = []
    for (name, pool), (tested, judged) in pairs(plan).items():
        right = round(100 * frame_rate([store.read(tested)]).value, 1)
        rows += [
            {"network fitted to": name, RIGHT: right, **_judged(judged, store, pool, method)}
            for method in METHODS
        ]
    rows.sort(key=lambda row: row[RIGHT])
    words = [_sentence(rows, method) for method in METHODS]
    for pool, unit in alone(plan).items():
        row = {"network fitted to": "none", RIGHT: None, **_judged(unit, store, pool, OURS)}
        rows.append(row)
        words.append(
            f"{OURS}, from the videos alone: accuracy {row['accuracy']} % over {row['pools']} "
            f"pool(s) of {pool}."
        )
    return Table(rows, words, notes=(INTERVALS,))


def _judged(unit: Unit, store: Store, pool: str, method: str) -> dict[str, Any]:
    """Return what a row says about a method."""
    scores = detection_scores(judged_by(unit, store, method))
    return {
        "pool": pool,
        "method": method,
        "pools": scores.pools,
        **score_cells(scores),
        "accuracy [%]": round(100 * scores.accuracy.value, 1),
    }


def figures(plan: Plan, store: Store) -> dict[str, Drawing]:
    """Return the accuracy of detection over the right frames, a figure per pool."""
    drawn: dict[str, Drawing] = {}
    for number, pool in enumerate(KINDS):
        series: dict[str, list[Point]] = {method: [] for method in METHODS}
        for (_, one), (tested, judged) in pairs(plan).items():
            if one != pool:
                continue
            right = 100 * frame_rate([store.read(tested)]).value
            for method in METHODS:
                rate = detection_scores(judged_by(judged, store, method)).accuracy
                series[method].append(Point(right, rate.value, rate.low, rate.high))
        drawn[f"appendix-e-{number + 1}"] = AccuracyFigure(
            {method: tuple(points) for method, points in series.items()},
            "accuracy of detection",
            f"frames right [%], pools of {pool}",
        )
    return drawn


def _sentence(rows: list[dict[str, Any]], method: str) -> str:
    mine = [row for row in rows if row["method"] == method]
    worst, best = mine[0][RIGHT], mine[-1][RIGHT]

    def mean(level: float) -> float:
        found = [row["accuracy [%]"] for row in mine if row[RIGHT] == level]
        return sum(found) / len(found)

    return (
        f"{method}: accuracy {mean(worst):.1f} % with {worst} % of the frames right, "
        f"{mean(best):.1f} % with {best} %."
    )


APPENDIX_E = Exhibit(
    "detection by the quality of segmentation and the clustering of weights",
    "compares qualities of segmentation, and k-means, a Gaussian mixture and mini-batch k-means; "
    "the numbers are in an appendix that was not available.",
    lambda plan: [*(unit for pair in pairs(plan).values() for unit in pair), *alone(plan).values()],
    table,
    figures,
)
