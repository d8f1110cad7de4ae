from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.common.errors import PoolError
from teasim.pool import EpisodeRecord, MistakeSpan, PoolHeader, Span
from teasim.pool.types import index_from_spans, spans_from_index
from tests.toy_pool import toy_header

NAMES = ("a", "b", "c")


def header(**changes: object) -> PoolHeader:
    return PoolHeader(**(vars(toy_header()) | changes))


@given(st.lists(st.integers(-1, len(NAMES) - 1), max_size=40))
def test_spans_hold_the_same_as_the_index(column: list[int]) -> None:
    spans = spans_from_index(np.array(column, dtype=np.int64), NAMES)
    np.testing.assert_array_equal(index_from_spans(spans, NAMES, len(column)), column)


@given(st.lists(st.integers(-1, len(NAMES) - 1), min_size=1, max_size=40))
def test_spans_are_ordered_and_as_long_as_possible(column: list[int]) -> None:
    spans = spans_from_index(np.array(column), NAMES)
    for before, after in pairwise(spans):
        assert before.stop <= after.start
        assert before.stop < after.start or before.subtask != after.subtask


def test_index_without_a_name_is_refused() -> None:
    with pytest.raises(PoolError, match=r"^subtask_index is 3 at frame 1 but the pool names 3 sub"):
        spans_from_index(np.array([0, 3]), NAMES)


@pytest.mark.parametrize(
    ("span", "message"),
    [
        (Span("x", 0, 1), "'x' is no sub-task of this pool; choose a, b, c."),
        (Span("a", 2, 6), "The span of a ends at frame 6 but the demonstration has 5 frames."),
    ],
)
def test_spans_outside_the_demonstration_are_refused(span: Span, message: str) -> None:
    with pytest.raises(PoolError) as caught:
        index_from_spans([span], NAMES, 5)
    assert str(caught.value) == message


def test_a_span_has_frames_and_a_skip_has_none() -> None:
    assert MistakeSpan("skip", "stir", 4, 4).stop == 4
    with pytest.raises(PoolError, match=r"^The span of stir runs from frame 4 to 4; that is no"):
        Span("stir", 4, 4)
    with pytest.raises(PoolError, match=r"^The span of skip of stir runs from frame 4 to 3"):
        MistakeSpan("skip", "stir", 4, 3)


def test_overlapping_spans_are_refused() -> None:
    spans = (Span("a", 0, 5), Span("b", 4, 8))
    with pytest.raises(
        PoolError, match=r"^The spans of a \(frames 0 to 5\) and b \(from frame 4\)"
    ):
        EpisodeRecord("seq_1", True, (), spans, "p1", "yumi", 0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fps": 0}, "fps is 0; a pool needs a whole number of 1 or more."),
        ({"height": 63}, "The frame height is 63; choose an even number of pixels."),
        ({"width": 0}, "The frame width is 0; choose an even number of pixels."),
        (
            {"cameras": (), "state_names": None},
            "The header names neither a camera nor a joint log; a pool needs one.",
        ),
        (
            {"cameras": ("a/b",)},
            "'a/b' is no camera name; use letters, digits, hyphen and underscore.",
        ),
        ({"subtasks": ("a", "a")}, "subtasks holds a name twice: a, a."),
    ],
)
def test_a_header_no_pool_can_be_written_with_is_refused(
    changes: dict[str, object], message: str
) -> None:
    with pytest.raises(PoolError) as caught:
        header(**changes)
    assert str(caught.value) == message


def test_a_config_json_cannot_hold_is_refused() -> None:
    with pytest.raises(PoolError, match=r"^The header's config cannot be written as JSON"):
        header(config={"x": float("nan")})
    with pytest.raises(PoolError, match=r"^The header's config cannot be written as JSON"):
        header(config={"x": object()})
