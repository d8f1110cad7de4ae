"""Stand-ins for the slow work of a reproduction: results of the right form within a millisecond."""

from dataclasses import asdict

import numpy as np

from filtering.judging.evidence import Evidence
from filtering.segmentation.metrics import TOLERANCES
from policies.experiments.reproduce.methods import Question, judge_all
from policies.experiments.reproduce.plan import Plan, Size
from teasim.pool import Span
from tests.toy_pool import SEQ_1, SEQ_2

TINY = Size(
    name="tiny",
    people={"seq1": 2, "seq2": 1, "seq3": 1},
    taught=2,
    robot={"seq1": 12, "seq2": 8, "seq3": 8},
    epochs=1,
    networks=1,
    ladder=(1,),
    pools=2,
    clustered=1,
    frames=1,
    incorrect=(2,),
    episodes=1,
    training_seeds=1,
)
STEPS = {"seq_1": SEQ_1, "seq_2": SEQ_2, "seq_3": SEQ_1[:1] + SEQ_1[2:]}


def spans(steps):
    return tuple(Span(name, 10 * k, 10 * k + 10) for k, name in enumerate(steps))


def evidence(kinds):
    """Evidence of true segments, a state per sub-task."""
    names = tuple(sorted(SEQ_1))
    demos = [STEPS[kind] for kind, count in kinds for _ in range(count)]
    states = [np.eye(len(names))[[names.index(name) for name in steps]] for steps in demos]
    return Evidence(names, tuple(map(spans, demos)), states=states)


def fake_bank(unit, store, workers):
    return {"demonstrations": 1}


def fake_segmentation(unit, store, workers):
    return {
        "frames": [[80.0, 100], [90.0, 100]],
        "subtasks": {str(p): [[50.0, 6], [100.0, 7]] for p in TOLERANCES},
        "edit": 75.0,
        "f1": {"10": 90.0, "25": 80.0, "50": 70.0},
    }


def fake_detection(unit, store, workers):
    kinds, known = unit.spec["kinds"], evidence(unit.spec["kinds"])
    wrong = np.repeat([place > 0 for place in range(len(kinds))], [count for _, count in kinds])
    names = tuple(f"demo{place}" for place in range(len(wrong)))
    said = judge_all(Question(known, wrong), names)
    one = {name: asdict(judged) for name, judged in said.items()}
    return {"pools": [one] * unit.spec["pools"]}


FAKES = {
    "bank": fake_bank,
    "network": fake_bank,
    "segmentation": fake_segmentation,
    "detection": fake_detection,
}


def tiny_plan(**options):
    return Plan(TINY, **options)
