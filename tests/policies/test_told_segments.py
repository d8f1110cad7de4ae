"""The judges of the tables know whether the segments are annotated ones or a segmenter's."""

import numpy as np
import pytest

from filtering.segmentation.segments import Segmentation
from policies.experiments.reproduce.exhibits import salads
from policies.experiments.reproduce.exhibits.salads import PREDICTED, TRUE, Salad, judge_salads
from policies.experiments.reproduce.readings import Reading
from policies.experiments.units import Unit
from teasim.common.workers import IN_PROCESS
from teasim.pool import Span
from teasim.pool.mstcn.folder import write_predictions

STEPS = ("cut", "mix")
DRAWN = [[Salad("v0", np.repeat([0, 1], 4), dressing_first=False)] * 3]


@pytest.mark.parametrize(("steps", "told"), [(TRUE, True), (PREDICTED, False)])
def test_true_labels_of_salads_are_told(tmp_path, monkeypatch, steps, told):
    labels = {"v0": DRAWN[0][0].labels}
    write_predictions(tmp_path / "salads", STEPS, labels, labels, {})
    seen = []
    monkeypatch.setattr(salads, "draw_salads", lambda *_: DRAWN)
    monkeypatch.setattr(salads, "read_salads", lambda *_: [])
    monkeypatch.setattr(salads, "judge_all", lambda question: seen.append(question.evidence.told))
    spec = {"folder": str(tmp_path / "salads"), "steps": steps, "k": 0, "pools": 1, "row": None}
    judge_salads(Unit("salads", spec), None, IN_PROCESS)
    assert seen == [told]


@pytest.mark.parametrize("told", [False, True])
def test_readings_pass_on_whether_segments_are_told(told):
    spans = ((Span("cut", 0, 4), Span("mix", 4, 8)),) * 4
    features = [np.random.default_rng(n).normal(size=(2, 3)) for n in range(4)]
    reading = Reading(Segmentation(STEPS, spans, told=told), features, features)
    assert reading.evidence([0, 1, 2]).told == told
