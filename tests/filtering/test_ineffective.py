"""An ineffective step is told from one that was carried out with effect."""

from dataclasses import replace

import hypothesis
import numpy as np
import pytest
from hypothesis import strategies as st

from filtering.config import FilterConfig
from filtering.judging.evidence import Evidence
from filtering.judging.explain import Clock, explain
from filtering.judging.judges import (
    INEFFECTIVE_PRIOR,
    Judgement,
    by_norm,
    ineffective_losses,
)
from filtering.judging.norm.norm_score import score_steps
from filtering.report.layout import Mark
from filtering.report.views import marks_of
from teasim.pool import Span

NAMES = ("a", "b", "c", "d")


def evidence(nats: list[list[float]] | None, demos: int = 8) -> Evidence:
    """`demos` times a, b, c, d, ten frames each, with these surprises."""
    spans = tuple(Span(name, 10 * n, 10 * n + 10) for n, name in enumerate(NAMES))
    known = Evidence(NAMES, (spans,) * demos)
    return known if nats is None else replace(known, ineffective=[*map(np.array, nats)])


def judged(nats: list[list[float]] | None) -> Judgement:
    return by_norm(evidence(nats), FilterConfig())


def test_an_ineffective_step_is_flagged_with_its_time_in_the_video() -> None:
    judgement = judged([[0.0] * 4] * 7 + [[0.0, 0.0, 9.0, 0.0]])
    assert judgement.grouping.flagged.tolist() == [False] * 7 + [True]
    assert explain(judgement.findings[-1], 10.0) == (
        "'c' was carried out (2.0-3.0 s), but it had no visible effect."
    )


def test_what_is_left_out_as_well_is_told_too() -> None:
    spans = [tuple(Span(name, 10 * n, 10 * n + 10) for n, name in enumerate(NAMES))] * 8
    spans[-1] = spans[-1][:3]
    ineffective = [np.zeros(len(demo)) for demo in spans]
    ineffective[-1][0] = 99.0
    known = Evidence(NAMES, tuple(spans), ineffective=ineffective)
    found = by_norm(known, FilterConfig()).findings[-1]
    assert {item.expected for item in found if item.missing} == {"d"}
    assert [item.ineffective.subtask for item in found if item.ineffective] == ["a"]


def test_where_nobody_looked_nothing_changes() -> None:
    assert judged(None).losses.tolist() == judged([[0.0] * 4] * 8).losses.tolist()


@hypothesis.given(
    st.lists(
        st.lists(st.floats(0, 30), min_size=4, max_size=4),
        min_size=8,
        max_size=8,
    )
)
@hypothesis.settings(max_examples=30, deadline=None)
def test_an_ineffective_step_is_never_worse_than_one_left_out(given: list[list[float]]) -> None:
    known = evidence(given)
    found = score_steps(known.counts)
    for nats, usual, given_nats in zip(
        ineffective_losses(found, known), found.usual, given, strict=True
    ):
        assert (nats <= usual + 1e-12).all()
        assert (nats >= 0).all()
        assert not nats[np.array(given_nats) <= INEFFECTIVE_PRIOR].any()


def test_the_loss_grows_by_the_worst_ineffective_step() -> None:
    without, losses = judged(None).losses, judged([[0.0] * 4] * 7 + [[1.5, 0.0, 2.5, 0.0]]).losses
    assert losses[-1] - without[-1] == pytest.approx(2.5 - INEFFECTIVE_PRIOR, abs=1e-9)


def test_the_timeline_marks_an_ineffective_step() -> None:
    judgement = judged([[0.0] * 4] * 7 + [[0.0, 0.0, 9.0, 0.0]])
    assert marks_of(judgement.findings[-1], Clock(10.0)) == (Mark(2.0, "c was ineffective"),)
