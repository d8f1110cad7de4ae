"""Table 4: 50-Salads in the paper's construction (section 4.2), from a folder that the user has.

Salads that begin with cutting are correct. Those that begin with the dressing count as incorrect
after the dressing is removed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from filtering.judging.evidence import Evidence
from policies.experiments.detection import detection_scores
from policies.experiments.reproduce.exhibits.detecting import (
    INTERVALS,
    against,
    judged_by,
    score_cells,
)
from policies.experiments.reproduce.exhibits.exhibit import Exhibit, Table
from policies.experiments.reproduce.methods import METHODS, NORM, Question, judge_all
from policies.experiments.reproduce.paper import (
    CORRECT,
    DETECTION,
    SEGMENTED_SALADS,
    precision_sentence,
)
from policies.experiments.reproduce.plan import SECONDS_PER_POOL, Plan
from policies.experiments.units import Result, Store, Unit
from teasim.common.workers import Workers
from teasim.pool import Span
from teasim.pool.mstcn.folder import MSTCNFolder
from teasim.pool.sequences import SequencePool
from teasim.pool.types import runs

DRESSING = ("add_oil", "add_vinegar", "add_salt", "add_pepper", "mix_dressing")
"""What is removed from salads that begin with it."""
NO_STEPS = ("action_start", "action_end")
"""Labels that are no step."""
TRUE, PREDICTED = "true labels", "predictions stored in the folder"
"""Where the steps come from."""
WHERE = (
    "50-Salads is not part of teasim. Its authors offer the videos (University of Dundee); the "
    "README of github.com/yabufarha/ms-tcn names a download of labels, features and splits in the "
    "form that is read here. Run again with --salads FOLDER, the folder with mapping.txt and "
    "groundTruth; with predictions/ the segments of a network are judged too."
)
"""What to do where the folder is missing."""


@dataclass(frozen=True)
class Salad:
    """A video as it is judged."""

    name: str
    """Name of the video."""
    labels: NDArray[np.int64]
    """(n,) label of each frame that belongs to a step."""
    dressing_first: bool
    """Whether it began with the dressing, which is then removed."""


def read_salads(folder: MSTCNFolder, source: str) -> list[Salad]:
    """Return the salads with their steps from TRUE or PREDICTED labels."""
    dressing = [folder.names.index(name) for name in DRESSING]
    dropped = [folder.names.index(name) for name in NO_STEPS if name in folder.names]
    salads = []
    for video in folder.videos:
        truth = folder.truth(video)
        assert truth is not None
        seen = truth if source == TRUE else folder.predictions(video)
        first = next(label for label in truth.tolist() if label not in (*dropped, -1))
        if first in dressing:
            seen = seen[~np.isin(truth, dressing)]
        salads.append(Salad(video, seen[~np.isin(seen, (*dropped, -1))], first in dressing))
    return salads


def draw_salads(
    salads: Sequence[Salad], k: int, pools: int, row: int | None = None
) -> Iterator[list[Salad]]:
    """Draw pools of CORRECT correct salads, then k others; k and `row` seed the draws."""
    correct = [salad for salad in salads if not salad.dressing_first]
    wrong = [salad for salad in salads if salad.dressing_first]
    for number in range(pools):
        rng = np.random.default_rng([k, number] if row is None else [k, number, row])
        good = rng.choice(len(correct), CORRECT, replace=False)
        bad = rng.choice(len(wrong), k, replace=False)
        yield [correct[place] for place in good] + [wrong[place] for place in bad]


def judge_salads(unit: Unit, store: Store, workers: Workers) -> Result:
    """Judge pools of salads by every method; there are no pictures, so no effects and features."""
    del store, workers
    spec = unit.spec
    folder = MSTCNFolder.open(Path(spec["folder"]))
    salads = read_salads(folder, spec["steps"])
    judged = []
    for number, pool in enumerate(draw_salads(salads, spec["k"], spec["pools"], spec["row"])):
        kinds = np.array([int(salad.dressing_first) for salad in pool])
        names = tuple(salad.name for salad in pool)
        known = _evidence(folder, pool, told=spec["steps"] == TRUE)
        judged.append(judge_all(Question(known, kinds, names, seed=number)))
    return {"pools": judged}


def _evidence(folder: MSTCNFolder, pool: Sequence[Salad], *, told: bool) -> Evidence:
    """Return the evidence of step lists; the state of equation 3 is the current step."""
    spans = tuple(
        tuple(Span(folder.names[run.label], run.start, run.stop) for run in runs(salad.labels))
        for salad in pool
    )
    known = Evidence(folder.names, spans, told=told)
    states = [np.eye(len(folder.names))[labels] for labels in known.labels]
    return replace(known, states=states)


def units(plan: Plan) -> list[Unit]:
    """Return the units of the table; none without the folder.

    Raises:
        PoolError: the folder is no MS-TCN folder, or a damaged one.
    """
    return [unit for _, _, unit in _units(plan)]


def _units(plan: Plan) -> list[tuple[str, int, Unit]]:
    if plan.salads is None:
        return []
    source = SequencePool.open(plan.salads)
    content = source.content_hash()
    steps = [PREDICTED, TRUE] if source.has_predictions else [TRUE]
    pools = plan.size.pools
    found = []
    for one in steps:
        for k in (printed.k for printed in DETECTION["table4"]):
            spec = {
                "content": content,
                "folder": str(plan.salads),
                "steps": one,
                "k": k,
                "pools": pools,
                "row": plan.seed,
            }
            found.append((one, k, Unit("salads", spec, seconds=pools * SECONDS_PER_POOL)))
    return found


def table(plan: Plan, store: Store) -> Table:
    """Return a row per k, source of the steps and method."""
    if plan.salads is None:
        return Table([], [], not_run=WHERE)
    printed = {row.k: row for row in DETECTION["table4"]}
    rows, words = [], [precision_sentence()]
    for steps, k, unit in _units(plan):
        for method in METHODS:
            scores = detection_scores(judged_by(unit, store, method))
            rows.append(
                {
                    "pool": f"{CORRECT} + {k}",
                    "steps": steps,
                    "method": method,
                    "pools": scores.pools,
                    **score_cells(scores),
                    "paper FP": printed[k].false_positives,
                    "paper accuracy": printed[k].accuracy,
                }
            )
            if method == NORM:  # what the default filter does where there are no videos
                words.append(against(f"{CORRECT} + {k}, {steps}", scores, printed[k]))
    return Table(rows, words, notes=(INTERVALS,))


TABLE_4 = Exhibit(
    "50-Salads: salads without their dressing beside ten complete ones",
    f"one pool per row, segmented with {SEGMENTED_SALADS} % of the frames right; all incorrect "
    "salads are found, one to three correct ones are accused.",
    units,
    table,
)
