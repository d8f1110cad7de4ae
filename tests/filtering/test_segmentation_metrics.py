"""Expected numbers are worked out by hand, beside each case."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from filtering.segmentation.metrics import (
    OVERLAPS,
    TOLERANCES,
    LabelPair,
    edit_score,
    f1_score,
    frame_accuracy,
    levenshtein,
    segmentation_scores,
    subtask_accuracy,
)
from filtering.segmentation.scoring import folder_pair
from teasim.pool.mstcn.folder import MSTCNFolder
from tests.filtering.conftest import real_data


def pair(truth: str, predicted: str) -> LabelPair:
    """Labels as letters; a dot is a frame of no sub-task."""
    return LabelPair(numbers(truth), numbers(predicted))


def numbers(letters: str) -> np.ndarray:
    return np.array([-1 if letter == "." else ord(letter) - ord("a") for letter in letters])


LATE = pair("aaaaabbbbb", "aaaaaaabbb")  # b begins two frames late
SPLIT = pair("aaaaaaaaaa", "aaaaabaaaa")  # one frame of b inside a


@pytest.mark.parametrize(
    ("case", "expected"), [(LATE, 80.0), (SPLIT, 90.0), (pair("ab", "ba"), 0.0)]
)
def test_frame_accuracy(case, expected):
    assert frame_accuracy([case]) == expected


def test_frame_accuracy_counts_frames_not_videos():
    # 1 of 2 and 9 of 10 frames: 10 of 12, not the mean of 50 % and 90 %.
    assert frame_accuracy([pair("ab", "aa"), SPLIT]) == pytest.approx(100 * 10 / 12)


@pytest.mark.parametrize(
    ("truth", "predicted", "expected"),
    [
        ("aabb", "abbb", 100.0),  # ab, ab: timing does not matter
        ("aaaa", "aaba", 100 * (1 - 2 / 3)),  # a, aba: two insertions of three
        ("abcd", "acbd", 50.0),  # two replacements of four
        ("aabb", "bbbb", 50.0),  # ab, b: one deletion of two
        ("abc.", "ab.c", 100.0),  # background is no segment
        ("....", "....", 100.0),
        ("aaaa", "....", 0.0),
    ],
)
def test_edit_score(truth, predicted, expected):
    assert edit_score(pair(truth, predicted)) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("first", "second", "distance"), [("kitten", "sitting", 3), ("", "abc", 3), ("ab", "ba", 2)]
)
def test_levenshtein(first, second, distance):
    assert levenshtein(list(map(ord, first)), list(map(ord, second))) == distance


@pytest.mark.parametrize(
    ("case", "overlap", "expected"),
    [
        # a: 5 of 7 frames, 71 %; b: 3 of 5, 60 %.
        (LATE, 50, 100.0),
        (LATE, 60, 100.0),
        (LATE, 61, 50.0),  # only a: 1 hit, 2 found, 2 exist
        (LATE, 72, 0.0),
        # Three found, one exists; the first a has 5 of 10 frames, the second 4 and is too late.
        (SPLIT, 50, 50.0),
        (SPLIT, 10, 50.0),
        (SPLIT, 51, 0.0),
        # The second c lies on nothing of its label; a and b are hit: 2 hits, 3 found, 2 exist.
        (pair("aabb", "aabc"), 50, 80.0),
        # The only predicted a meets one frame of each true a: 1 of 5 and 1 of 4 frames.
        (pair("aaabaa", "bbaaab"), 25, 100 * 2 / 6),
        (pair("aaabaa", "bbaaab"), 26, 0.0),
        (pair("aa..", "aaaa"), 50, 100.0),  # 2 of 4 frames
        (pair("....", "...."), 50, 100.0),
        (pair("....", "aa.."), 50, 0.0),
    ],
)
def test_f1(case, overlap, expected):
    assert f1_score([case], overlap) == pytest.approx(expected)


def test_f1_counts_segments_over_all_videos():
    # LATE at 61 %: 1 hit of 2 and 2; a perfect video of 1 and 1: together 2 hits of 3 and 3.
    assert f1_score([LATE, pair("aa", "aa")], 61) == pytest.approx(100 * 2 / 3)


@pytest.mark.parametrize(
    ("tolerance", "expected"),
    [(0, 1), (9, 1), (10, 2), (20, 3), (29, 3), (30, 4), (100, 5)],
)
def test_subtask_accuracy_is_the_share_of_segments_with_few_wrong_frames(tolerance, expected):
    # Wrong frames of the five segments of ten: 0, 1, 2, 3, 10; a tolerance includes its bound.
    truth = "".join(10 * letter for letter in "abcde")
    predicted = "a" * 10 + "b" * 9 + "a" + "c" * 8 + "aa" + "d" * 7 + "aaa" + "a" * 10
    assert subtask_accuracy([pair(truth, predicted)], tolerance) == pytest.approx(20 * expected)


def test_frames_of_no_subtask_count_for_accuracy_alone():
    case = pair("aa..bb", "aaaabb")
    scores = segmentation_scores([case])
    assert scores.accuracy == pytest.approx(100 * 4 / 6)
    assert scores.edit == 100.0
    assert set(scores.subtask_accuracy.values()) == {100.0}


def test_labels_that_cannot_be_compared_are_refused():
    with pytest.raises(ValueError, match="2 true labels, 3 predicted"):
        pair("ab", "abc")
    with pytest.raises(ValueError, match="0 true labels"):
        pair("", "")


LABELS = st.lists(st.integers(-1, 3), min_size=1, max_size=30).map(np.array)
PAIRS = st.integers(1, 30).flatmap(
    lambda n: st.tuples(*2 * [st.lists(st.integers(-1, 3), min_size=n, max_size=n).map(np.array)])
)


def rates(pairs: list[LabelPair]) -> list[float]:
    s = segmentation_scores(pairs)
    return [s.accuracy, s.edit, *s.f1.values(), *s.subtask_accuracy.values()]


@given(LABELS)
def test_a_perfect_prediction_scores_100(labels):
    assert rates([LabelPair(labels, labels)]) == [100.0] * 9


@given(PAIRS)
def test_scores_lie_in_0_100_and_do_not_depend_on_what_labels_are_called(labels):
    truth, predicted = labels
    scores = rates([LabelPair(truth, predicted)])
    assert all(0.0 <= score <= 100.0 for score in scores)
    other = np.array([7, 2, 9, 4, -1])  # by label; the last one is that of -1
    assert rates([LabelPair(other[truth], other[predicted])]) == scores


@given(PAIRS)
def test_a_video_seen_twice_changes_no_rate(labels):
    case = LabelPair(*labels)
    np.testing.assert_allclose(rates([case, case]), rates([case]))


@given(PAIRS)
def test_slower_videos_score_the_same(labels):
    slow = LabelPair(*(np.repeat(part, 3) for part in labels))
    np.testing.assert_allclose(rates([slow]), rates([LabelPair(*labels)]))


@given(PAIRS)
def test_more_overlap_is_harder_and_more_tolerance_is_easier(labels):
    scores = segmentation_scores([LabelPair(*labels)])
    assert [scores.f1[k] for k in OVERLAPS] == sorted(scores.f1.values(), reverse=True)
    assert [scores.subtask_accuracy[p] for p in TOLERANCES] == sorted(
        scores.subtask_accuracy.values()
    )


def test_predictions_of_others_on_50_salads_score_as_their_program_says():
    # Edit and F1 from the published evaluation program of MS-TCN on the same files.
    folder = MSTCNFolder.open(real_data("50salads"))
    scores = segmentation_scores([folder_pair(folder, video) for video in folder.videos])
    assert (scores.videos, len(folder.names)) == (50, 19)
    assert scores.accuracy == pytest.approx(82.878, abs=5e-4)
    assert scores.edit == pytest.approx(73.338, abs=5e-4)
    assert [*scores.f1.values()] == pytest.approx([80.961, 79.548, 71.913], abs=5e-4)
