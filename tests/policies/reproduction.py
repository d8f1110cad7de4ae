"""Stand-ins for the slow work of a reproduction: results of the right form within a millisecond."""

from functools import lru_cache

import numpy as np

from filtering.judging.evidence import Evidence
from filtering.segmentation.metrics import TOLERANCES
from policies.experiments.reproduce.exhibits.salads import judge_salads
from policies.experiments.reproduce.methods import (
    NORM,
    OURS,
    Question,
    judge_all,
    judge_thresholds,
    weigh_all,
)
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
    unlabelled=(1,),
    frames=1,
    incorrect=(2,),
    pixels=64,
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
    return Evidence(names, tuple(map(spans, demos)), states=states, told=True)


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
    said = judged(unit.kind, tuple((kind, count) for kind, count in unit.spec["kinds"]))
    if unit.spec["videos"]:  # the default filter says the same as the norm
        methods = said.get("methods", said)
        ours = {OURS: methods[NORM], **methods}
        said = said | {"methods": ours} if "methods" in said else ours
    return {"pools": [said] * unit.spec["pools"]}


@lru_cache  # SLSQP takes a second
def judged(work, kinds):
    judge = {"detection": judge_all, "thresholds": judge_thresholds, "weights": weigh_all}
    places = np.repeat(range(len(kinds)), [count for _, count in kinds])
    names = tuple(f"demo{place}" for place in range(len(places)))
    return judge[work](Question(evidence(kinds), places, names))


def fake_policies(unit, store, workers):
    spread = {"policy_accuracy": 0.9, "policy_accuracy_low": 0.8, "policy_accuracy_high": 0.95}
    change = {"difference": 0.1, "difference_low": 0.05, "difference_high": 0.2}
    results = [
        {"learner": learner, "filter": name, "mode": mode, "seed": 0, "episodes": 1, "success": 1.0}
        | spread
        | change
        for learner in unit.spec["learners"]
        for name in ("all", "filtered", "oracle", "length", "random")
        for mode in ("deterministic", "sampled")
    ]
    detection = [{"filter": "filtered", "recall": 1.0, "false_alarms": 0.1}]
    return {"results": results, "detection": detection}


FAKES = {
    "bank": fake_bank,
    "network": fake_bank,
    "segmentation": fake_segmentation,
    "detection": fake_detection,
    "thresholds": fake_detection,
    "weights": fake_detection,
    "salads": judge_salads,
    "policies": fake_policies,
}


def tiny_plan(**options):
    return Plan(TINY, **options)
