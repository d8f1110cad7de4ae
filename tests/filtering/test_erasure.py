"""What a decision loses without a channel."""

from collections.abc import Sequence

import numpy as np
import pytest

from filtering.features.erasure import erasure_importance, max_over_time, rank_channels
from filtering.features.graphs.intervals import Intervals

CHANNELS = 4
VALUES = np.array([[3.0, 1.0, 0.0, 2.0], [0.0, 4.0, 0.0, 2.0], [5.0, 1.0, 1.0, 0.5]])
"""Value of the one interval of each channel in three clips; 0 is none."""
LABELS = np.array([0, 1, 0])
WEIGHTS = np.array([[1.0, -1.0, 0.5, 0.0], [-1.0, 1.0, -0.5, 0.0]])


def clip(values: np.ndarray) -> Intervals:
    channels = np.flatnonzero(values)
    starts = np.zeros_like(channels)
    return Intervals(channels, starts, starts + 5, values[channels])


CLIPS = [clip(values) for values in VALUES]


def linear(clips: Sequence[Intervals]) -> np.ndarray:
    """Logits whose mean over the two classes is 0: a weighted sum of the intervals' values."""
    return np.stack([WEIGHTS[:, intervals.channels] @ intervals.values for intervals in clips])


def importance(decide=linear, labels: np.ndarray = LABELS) -> np.ndarray:
    return erasure_importance(decide, CLIPS, labels, CHANNELS)


def test_a_linear_decision_loses_each_channels_share() -> None:
    shares = [WEIGHTS[label] * values for label, values in zip(LABELS, VALUES, strict=True)]
    relative = np.array([share / share.sum() for share in shares])
    assert np.allclose(importance()[0], relative[[0, 2]].mean(axis=0))
    assert np.allclose(importance()[1], relative[1])
    assert np.allclose(importance().sum(axis=1), 1.0)
    assert np.all(importance()[:, 3] == 0.0)


def test_what_a_softmax_does_not_see_is_not_seen() -> None:
    def shifted(clips: Sequence[Intervals]) -> np.ndarray:
        return linear(clips) - 100.0 + np.array([[len(intervals)] for intervals in clips])

    assert np.allclose(importance(shifted), importance())
    assert np.allclose(importance(lambda clips: 7 * linear(clips)), importance())


def test_a_class_that_is_never_recognised_has_no_important_channel() -> None:
    assert not importance(labels=1 - LABELS).any()
    assert not importance(lambda clips: np.zeros((len(clips), 2))).any()
    mixed = importance(labels=np.array([0, 0, 0]))
    assert not mixed[1].any()
    assert np.allclose(mixed[0], importance()[0])


def test_the_decision_is_asked_about_intervals_that_are_really_gone() -> None:
    asked: list[list[int]] = []

    def remember(clips: Sequence[Intervals]) -> np.ndarray:
        asked.append(sorted({int(c) for intervals in clips for c in intervals.channels}))
        return linear(clips)

    importance(remember)
    assert asked == [[0, 1, 2, 3], [1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]


def test_a_channel_ranks_by_the_class_that_needs_it_most() -> None:
    ranked = rank_channels(np.array([[0.2, 0.9, 0.0, 0.3], [0.2, -3.0, 0.0, 0.4]]))
    assert ranked.tolist() == [1, 3, 0, 2]
    assert rank_channels(np.zeros((2, 3))).tolist() == [0, 1, 2]


def test_features_are_the_largest_activations_of_the_kept_channels() -> None:
    segments = [np.array([[1.0, -5.0, 3.0], [2.0, -4.0, 0.0]]), np.full((5, 3), -1.0)]
    features = max_over_time(segments, np.array([1, 0]))
    assert features.tolist() == [[2.0, -4.0, 0.0], [-1.0, -1.0, 0.0]]
    assert features.dtype == np.float64


@pytest.mark.parametrize("frames", [1, 7, 64])
def test_features_do_not_depend_on_the_order_of_frames(frames: int) -> None:
    segment = np.random.default_rng(0).normal(size=(frames, 5)).astype(np.float32)
    kept = np.array([4, 2])
    assert np.array_equal(max_over_time([segment], kept), max_over_time([segment[::-1]], kept))
