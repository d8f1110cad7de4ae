"""When a channel is active: threshold, closing, opening, runs."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from filtering.features.graphs.intervals import Intervals, find_intervals, mean_thresholds

Run = tuple[int, int]


def runs(active: list[bool], value: bool) -> list[Run]:
    """[start, stop) of the runs of `value`, found frame by frame."""
    found, start = [], None
    for frame, is_active in enumerate([*active, not value]):
        if is_active == value and start is None:
            start = frame
        elif is_active != value and start is not None:
            found.append((start, frame))
            start = None
    return found


def closed_then_opened(active: list[bool], structure: int) -> list[Run]:
    """What a structuring element of that length does, said in words of runs."""
    frames = list(active)
    for start, stop in runs(frames, False):
        if start > 0 and stop < len(frames) and stop - start < structure:
            frames[start:stop] = [True] * (stop - start)
    return [(start, stop) for start, stop in runs(frames, True) if stop - start >= structure]


@given(st.lists(st.booleans(), min_size=1, max_size=40), st.integers(1, 6))
def test_short_gaps_are_closed_then_short_intervals_are_dropped(
    active: list[bool], structure: int
) -> None:
    activations = np.array(active, dtype=np.float32)[:, None]
    found = find_intervals(activations, np.array([0.5]), structure)
    assert [
        (int(start), int(stop)) for start, stop in zip(found.starts, found.stops, strict=True)
    ] == closed_then_opened(active, structure)


@given(st.lists(st.booleans(), min_size=1, max_size=30), st.integers(1, 5))
def test_time_has_no_direction(active: list[bool], structure: int) -> None:
    activations = np.array(active, dtype=np.float64)[:, None]
    there = find_intervals(activations, np.array([0.5]), structure)
    back = find_intervals(activations[::-1], np.array([0.5]), structure)
    assert (len(active) - back.stops[::-1]).tolist() == there.starts.tolist()
    assert (len(active) - back.starts[::-1]).tolist() == there.stops.tolist()


def test_what_is_active_at_the_first_and_last_frame_stays_whole() -> None:
    activations = np.array([1, 1, 1, 0, 0, 0, 0, 1, 1, 1], dtype=np.float64)[:, None]
    found = find_intervals(activations, np.array([0.5]), 3)
    assert found.starts.tolist() == [0, 7]
    assert found.stops.tolist() == [3, 10]


def test_intervals_come_by_channel_then_time_with_their_largest_activation() -> None:
    activations = np.zeros((20, 3))
    activations[2:6, 2] = (1.0, 3.0, 2.0, 1.0)
    activations[10:14, 0] = 5.0
    activations[1:5, 0] = (4.0, 0.2, 6.0, 4.0)  # the gap is closed
    found = find_intervals(activations, np.full(3, 0.5), 2)
    assert found.channels.tolist() == [0, 0, 2]
    assert found.starts.tolist() == [1, 10, 2]
    assert found.stops.tolist() == [5, 14, 6]
    assert found.values.tolist() == [6.0, 5.0, 3.0]


def test_thresholds_are_means_over_all_frames_however_long_the_segments() -> None:
    short, long = np.full((1, 2), (4.0, 0.0)), np.full((3, 2), (0.0, 8.0))
    assert mean_thresholds([short, long]).tolist() == [1.0, 6.0]


def test_a_channel_that_never_changes_has_no_interval() -> None:
    still = np.full((10, 1), 0.1)
    assert len(find_intervals(still, mean_thresholds([still, still]), 3)) == 0


def test_intervals_without_channels_are_those_of_the_others() -> None:
    intervals = Intervals(
        channels=np.array([0, 1, 1, 3]),
        starts=np.array([0, 2, 8, 1]),
        stops=np.array([4, 5, 9, 3]),
        values=np.array([1.0, 2.0, 3.0, 4.0]),
    )
    left = intervals.without([1, 2])
    assert left.channels.tolist() == [0, 3]
    assert left.values.tolist() == [1.0, 4.0]
    assert len(intervals) == 4
    assert len(intervals.without([0, 1, 3])) == 0


def test_impossible_intervals_are_refused() -> None:
    one = np.array([1])
    with pytest.raises(ValueError, match="an interval is empty"):
        Intervals(one, one, one, np.array([1.0]))
    with pytest.raises(ValueError, match="fields differ in length"):
        Intervals(one, one, np.array([2, 3]), np.array([1.0]))
