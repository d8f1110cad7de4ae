"""What is shown beside a flagged demonstration: its stretch, and the same in a trusted one."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from filtering.demo_filter import DemoFilter
from filtering.judging.explain import Counterpart, Finding
from filtering.report.exhibits import MOST, exhibits_of
from filtering.report.views import demo_views
from teasim.pool import Pool, Span
from tests.toy_pool import copy_pool, strip_ground_truth


def test_what_is_missing_is_shown_where_it_was_expected_and_where_another_has_it(
    toy_filter: DemoFilter, toy_pool: Pool
) -> None:
    for demo, step in ((2, "add_water"), (5, "turn_off_oven")):
        exhibit = exhibits_of(toy_pool, toy_filter, demo)[0]
        assert exhibit.finding.expected == step
        assert exhibit.own.span.start <= exhibit.finding.frame <= exhibit.own.span.stop
        assert exhibit.own.frames == (
            min(exhibit.finding.frame, toy_pool.episodes[demo].length - 1),
        )
        assert exhibit.other is not None
        assert not toy_filter.flagged_[exhibit.other.demo]
        assert exhibit.other.span in toy_filter.segments_.spans[exhibit.other.demo]
        assert exhibit.other.span.subtask == step
        (frame,) = exhibit.other.frames
        assert exhibit.other.span.start <= frame < exhibit.other.span.stop


def fitted(toy_filter: DemoFilter, *findings: Finding) -> Any:
    """A fitted filter with other findings for its first demonstration."""
    own = (findings, *toy_filter.findings_[1:])
    return SimpleNamespace(**{**vars(toy_filter), "findings_": own})


def test_an_ineffective_step_is_shown_before_and_after_in_both(
    toy_filter: DemoFilter, toy_pool: Pool
) -> None:
    span = toy_filter.segments_.spans[0][2]
    finding = Finding(span.subtask, span.subtask, None, span.start, False, 3.0, ineffective=span)
    (exhibit,) = exhibits_of(toy_pool, fitted(toy_filter, finding), 0)
    assert exhibit.own.frames == (span.start - 1, span.stop)
    assert exhibit.other is not None
    assert exhibit.other.demo != 0
    assert exhibit.other.span.subtask == span.subtask
    assert exhibit.other.frames == (exhibit.other.span.start - 1, exhibit.other.span.stop)


def test_a_counterpart_is_shown_as_it_was_found(toy_filter: DemoFilter, toy_pool: Pool) -> None:
    span = Span("what", 3, 9)
    finding = Finding("what", None, None, 40, True, 3.0, counterpart=Counterpart(4, span, "cup"))
    found = fitted(toy_filter, *[replace(finding, frame=frame) for frame in range(40, 46)])
    exhibits = exhibits_of(toy_pool, found, 0)
    assert len(exhibits) == MOST
    assert exhibits[0].other is not None
    assert (exhibits[0].other.demo, exhibits[0].other.span) == (4, span)


def test_labels_are_shown_and_decide_nothing(
    toy_filter: DemoFilter, toy_pool: Pool, tmp_path: Path
) -> None:
    told = demo_views(toy_pool, toy_filter, tmp_path)
    assert [demo.truth is not None and demo.truth.correct for demo in told] == [
        not flagged for flagged in toy_filter.flagged_
    ]
    assert told[2].truth is not None
    assert told[2].truth.mistakes.startswith("skip of add_water at ")
    blind = strip_ground_truth(copy_pool(toy_pool, tmp_path / "copy"))
    untold = demo_views(blind, toy_filter, tmp_path)
    assert [demo.truth for demo in untold] == [None] * len(untold)
    assert [replace(demo, truth=None) for demo in told] == untold


def test_steps_without_a_trusted_video_stand_alone(toy_filter: DemoFilter, toy_pool: Pool) -> None:
    finding = Finding("unheard_of", None, None, 40, True, 3.0)
    (exhibit,) = exhibits_of(toy_pool, fitted(toy_filter, finding), 0)
    assert exhibit.other is None
    assert np.diff([exhibit.own.span.start, exhibit.own.span.stop])[0] > 0
