"""Tables 2 and 3: 10 correct demonstrations and k sub-optimal (Seq_2) or incorrect (Seq_3) ones."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from policies.experiments.detection import DetectionScores, Judged, detection_scores
from policies.experiments.reproduce.exhibits.exhibit import Exhibit, Table
from policies.experiments.reproduce.methods import METHODS, NORM, OURS
from policies.experiments.reproduce.paper import (
    CORRECT,
    DETECTION,
    PaperRow,
    precision_sentence,
)
from policies.experiments.reproduce.plan import (
    PEOPLE_LEVEL,
    ROBOT_LEVEL,
    SECONDS_PER_CLUSTERED,
    SECONDS_PER_FILTERED,
    SECONDS_PER_POOL,
    SEGMENTERS,
    UNLABELLED,
    Plan,
)
from policies.experiments.units import Store, Unit
from teasim.common.figures import AccuracyFigure, Drawing
from teasim.common.figures.accuracy import Point
from teasim.common.statistics import Rate

OTHERS: Mapping[str, str] = MappingProxyType({"table2": "seq_2", "table3": "seq_3"})
"""The other demonstrations of each table."""
COMPARED: Mapping[tuple[str, str], str] = MappingProxyType(
    {
        (OURS, UNLABELLED): "ours, from the videos alone",
        (OURS, PEOPLE_LEVEL): "with a network at the paper's level of segmentation",
        (NORM, PEOPLE_LEVEL): "norm at the paper's level of segmentation",
    }
)
"""Methods and segmenters that are compared with the paper's numbers, and how that is called."""
INTERVALS = (
    "Rates are in % with 95 % intervals, the wider one of two: with each pool, and with each "
    "demonstration of the bank, as a group of correlated trials. Length and random are told how "
    "many demonstrations are incorrect; the oracle reads the labels."
)
"""How the rates are to be read."""


def pools_unit(
    plan: Plan, kinds: Sequence[tuple[str, int]], segmenter: str, *, row: int, work: str
) -> Unit:
    """Return the unit that judges pools of some demonstrations of each kind.

    Args:
        plan: what is reproduced.
        kinds: orders of sub-tasks and numbers of demonstrations; the first kind is correct.
        segmenter: one of SEGMENTERS.
        row: number from which, with the plan's seed, the pools are drawn.
        work: kind of the unit: detection, thresholds or weights.
    """
    size = plan.size
    pools = size.clustered if segmenter == UNLABELLED else size.pools
    each = SECONDS_PER_CLUSTERED if segmenter == UNLABELLED else SECONDS_PER_POOL
    spec = {
        "kinds": [list(kind) for kind in kinds],
        "segmenter": segmenter,
        "row": 1000 * plan.seed + row,
        "pools": pools,
        "frames": size.frames,
        "videos": by_videos(segmenter, work),
    }
    if spec["videos"] and segmenter != UNLABELLED:
        each += SECONDS_PER_FILTERED
    needs = {"bank": plan.bank("robot"), **plan.segmenter(segmenter)}
    return Unit(work, spec, needs, pools * each)


def judged_by(unit: Unit, store: Store, method: str) -> list[Judged]:
    """Return what a method said about the pools of a unit that is done."""
    return [Judged.from_json(pool[method]) for pool in store.read(unit)["pools"]]


def percent(rate: Rate) -> str:
    """Write a rate as in a table, for example '85.7 (60.1-96.0)'."""
    if not rate.trials:
        return ""
    return f"{100 * rate.value:.1f} ({100 * rate.low:.1f}-{100 * rate.high:.1f})"


def score_cells(scores: DetectionScores) -> dict[str, Any]:
    """Return the cells of a row that hold scores."""
    return {
        "TP": scores.true_positives,
        "FP": scores.false_positives,
        "FN": scores.false_negatives,
        "accuracy": percent(scores.accuracy),
        "recall": percent(scores.recall),
        "precision": percent(scores.precision),
        "F1": round(100 * scores.f1, 1),
        "AUROC": round(scores.auroc, 3),
        "Brier": round(scores.brier, 3),
    }


def against(what: str, scores: DetectionScores, printed: PaperRow) -> str:
    """Write how the accuracy of a row relates to the paper's."""
    rate, paper = scores.accuracy, printed.accuracy / 100
    if rate.low > paper:
        verdict = "better than the paper's"
    elif rate.high < paper:
        verdict = "worse than the paper's"
    else:
        verdict = "not told apart from the paper's"
    return (
        f"{what}: accuracy {percent(rate)} % over {scores.pools} pool(s), {verdict} "
        f"{printed.accuracy} % of one pool; {scores.false_positives / scores.pools:.2f} correct "
        f"demonstrations accused per pool (the paper {printed.false_positives}), recall "
        f"{percent(scores.recall)} % (the paper 100 %)."
    )


def units(plan: Plan, name: str) -> list[Unit]:
    """Return the units of a table, by k and segmenter."""
    return [
        _unit(plan, name, number, segmenter)
        for number, printed in enumerate(DETECTION[name])
        for segmenter in segmenters(plan, printed.k)
    ]


def segmenters(plan: Plan, k: int) -> list[str]:
    """Return the segmenters of a row; clustering is slow, and not run for every k in quick."""
    return [name for name in SEGMENTERS if name != UNLABELLED or k in plan.size.unlabelled]


def methods(segmenter: str) -> list[str]:
    """Return the methods of a segmenter; videos are looked at where `by_videos` says so."""
    return [OURS, *METHODS] if by_videos(segmenter, "detection") else list(METHODS)


def by_videos(segmenter: str, work: str) -> bool:
    """Return whether the default filter judges too: without labels, or at the paper's level.

    With a network of our level the sub-tasks alone tell what is to be told.
    """
    return segmenter == UNLABELLED or (segmenter == PEOPLE_LEVEL and work == "detection")


def table(plan: Plan, store: Store, name: str) -> Table:
    """Return all rows of a table: k x segmenter x method."""
    rows, words = [], [precision_sentence()]
    for number, printed in enumerate(DETECTION[name]):
        for segmenter in segmenters(plan, printed.k):
            unit = _unit(plan, name, number, segmenter)
            for method in methods(segmenter):
                scores = detection_scores(judged_by(unit, store, method))
                rows.append(
                    {
                        "pool": f"{CORRECT} + {printed.k}",
                        "segmenter": SEGMENTERS[segmenter],
                        "method": method,
                        "pools": scores.pools,
                        **score_cells(scores),
                        "paper FP": printed.false_positives,
                        "paper accuracy": printed.accuracy,
                        "paper precision": round(printed.true_precision, 1),
                        "paper F1 (printed as precision)": printed.precision,
                    }
                )
                if (method, segmenter) in COMPARED:
                    what = f"{CORRECT} + {printed.k}, {COMPARED[method, segmenter]}"
                    words.append(against(what, scores, printed))
    return Table(rows, words, notes=(INTERVALS,))


def figures(plan: Plan, store: Store, name: str) -> dict[str, Drawing]:
    """Return the accuracy over k: of the default filter, of fitted segmenters, and length."""
    shown = {"ours, from videos alone": (OURS, UNLABELLED)}
    shown |= {f"ours, {SEGMENTERS[PEOPLE_LEVEL]}": (OURS, PEOPLE_LEVEL)}
    shown |= {f"norm, {SEGMENTERS[s]}": (NORM, s) for s in (PEOPLE_LEVEL, ROBOT_LEVEL)}
    shown |= {"length, told k": ("length", PEOPLE_LEVEL)}
    series: dict[str, tuple[Point, ...]] = {}
    for title, (method, segmenter) in shown.items():
        points = []
        for number, printed in enumerate(DETECTION[name]):
            if segmenter in segmenters(plan, printed.k):
                judged = judged_by(_unit(plan, name, number, segmenter), store, method)
                points.append(_point(printed.k, detection_scores(judged).accuracy))
        series[title] = tuple(points)
    paper = [(row.k, row.accuracy / 100) for row in DETECTION[name]]
    series["the paper, one pool"] = tuple(Point(k, share, share, share) for k, share in paper)
    return {name: AccuracyFigure(series, "accuracy of detection")}


def _point(k: int, rate: Rate) -> Point:
    return Point(k, rate.value, rate.low, rate.high)


def _unit(plan: Plan, name: str, number: int, segmenter: str) -> Unit:
    kinds = [("seq_1", CORRECT), (OTHERS[name], DETECTION[name][number].k)]
    row = 100 * list(OTHERS).index(name) + number
    return pools_unit(plan, kinds, segmenter, row=row, work="detection")


def exhibit(name: str, title: str, paper: str) -> Exhibit:
    """Return the exhibit of table 2 or 3."""
    return Exhibit(
        title,
        paper,
        lambda plan: units(plan, name),
        lambda plan, store: table(plan, store, name),
        lambda plan, store: figures(plan, store, name),
    )


TABLE_2 = exhibit(
    "table2",
    "sub-optimal demonstrations (Seq_2) beside ten correct ones",
    "one pool per row; all Seq_2 are found, one to three correct demonstrations are accused.",
)
TABLE_3 = exhibit(
    "table3",
    "incorrect demonstrations (Seq_3) beside ten correct ones",
    "one pool per row; all Seq_3 are found, one or two correct demonstrations are accused.",
)
