"""A step of which nothing came is told from one that was carried out with effect."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.config import FilterConfig
from filtering.judging.explain import Clock, explain
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.verdict import IDLE_DOUBT, Evidence, Verdict, by_norm, in_vain
from filtering.report.layout import Mark
from filtering.report.views import marks_of
from teasim.pool import Span

NAMES = ("a", "b", "c", "d")


def evidence(idle: list[list[float]] | None, demos: int = 8) -> Evidence:
    """`demos` times a, b, c, d, ten frames each, with these surprises."""
    spans = tuple(Span(name, 10 * n, 10 * n + 10) for n, name in enumerate(NAMES))
    known = Evidence(NAMES, (spans,) * demos)
    return known if idle is None else replace(known, idle=[np.array(nats) for nats in idle])


def judged(idle: list[list[float]] | None) -> Verdict:
    return by_norm(evidence(idle), FilterConfig().rule())


def test_a_step_in_vain_is_flagged_with_its_time_in_the_video() -> None:
    verdict = judged([[0.0] * 4] * 7 + [[0.0, 0.0, 9.0, 0.0]])
    assert verdict.grouping.flagged.tolist() == [False] * 7 + [True]
    assert explain(verdict.findings[-1], 10.0) == (
        "c was seen (2.0-3.0 s), but nothing came of it."
    )


def test_what_is_left_out_as_well_is_told_too() -> None:
    spans = [tuple(Span(name, 10 * n, 10 * n + 10) for n, name in enumerate(NAMES))] * 8
    spans[-1] = spans[-1][:3]
    idle = [np.zeros(len(demo)) for demo in spans]
    idle[-1][0] = 99.0
    found = by_norm(Evidence(NAMES, tuple(spans), idle=idle), FilterConfig().rule()).findings[-1]
    assert {item.expected for item in found if item.missing} == {"d"}
    assert [item.idle.subtask for item in found if item.idle] == ["a"]


def test_where_nobody_looked_nothing_changes() -> None:
    assert judged(None).losses.tolist() == judged([[0.0] * 4] * 8).losses.tolist()


@given(
    st.lists(
        st.lists(st.floats(0, 30), min_size=4, max_size=4),
        min_size=8,
        max_size=8,
    )
)
@settings(max_examples=30, deadline=None)
def test_a_step_in_vain_is_never_worse_than_one_left_out(idle: list[list[float]]) -> None:
    known = evidence(idle)
    found = score_steps(known.counts)
    for nats, usual, given_nats in zip(in_vain(found, known), found.usual, idle, strict=True):
        assert (nats <= usual + 1e-12).all()
        assert (nats >= 0).all()
        assert not nats[np.array(given_nats) <= IDLE_DOUBT].any()


def test_the_loss_grows_by_the_worst_step_in_vain() -> None:
    without, losses = judged(None).losses, judged([[0.0] * 4] * 7 + [[1.5, 0.0, 2.5, 0.0]]).losses
    assert losses[-1] - without[-1] == pytest.approx(2.5 - IDLE_DOUBT, abs=1e-9)


def test_the_timeline_says_that_nothing_came_of_it() -> None:
    verdict = judged([[0.0] * 4] * 7 + [[0.0, 0.0, 9.0, 0.0]])
    assert marks_of(verdict.findings[-1], Clock(10.0)) == (Mark(2.0, "nothing came of c"),)
