import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from filtering.judging.equation3.sequence import (
    Transitions,
    done_so_far,
    next_labels,
    state_rows,
    transitions,
)

N_SUBTASKS = 7
labels_lists = st.lists(st.integers(0, N_SUBTASKS - 1), min_size=1, max_size=12)


@given(labels_lists)
def test_history_grows_and_holds_exactly_what_was_done(labels: list[int]) -> None:
    done = done_so_far(labels, N_SUBTASKS)
    assert done.shape == (len(labels) + 1, N_SUBTASKS)
    assert (np.diff(done, axis=0) >= 0).all()
    for row, values in enumerate(done):
        assert set(np.flatnonzero(values)) == set(labels[:row])


@given(labels_lists)
def test_each_row_asks_for_what_follows_and_the_last_for_the_end(labels: list[int]) -> None:
    following = next_labels(labels, N_SUBTASKS)
    assert following.tolist() == [*labels, N_SUBTASKS]
    assert (following == N_SUBTASKS).sum() == 1


@given(labels_lists, st.integers(0, N_SUBTASKS - 1), st.data())
def test_a_state_never_depends_on_what_follows(
    labels: list[int], other: int, data: st.DataObject
) -> None:
    row = data.draw(st.integers(0, len(labels) - 1))
    changed = [*labels[:row], other, *labels[row + 1 :]]
    features = np.ones((len(labels), 3))
    before = state_rows(features, labels, N_SUBTASKS)[: row + 1]
    assert np.array_equal(before, state_rows(features, changed, N_SUBTASKS)[: row + 1])


@given(st.lists(labels_lists, min_size=1, max_size=5))
def test_rows_of_all_demonstrations_are_stacked_in_order(demos: list[list[int]]) -> None:
    features = [np.full((len(labels), 2), float(d)) for d, labels in enumerate(demos)]
    rows = transitions(features, demos, N_SUBTASKS)
    assert rows.n_demos == len(demos)
    assert np.bincount(rows.demos).tolist() == [len(labels) + 1 for labels in demos]
    for demo, labels in enumerate(demos):
        mine = rows.demos == demo
        assert rows.nexts[mine].tolist() == [*labels, N_SUBTASKS]
        assert np.array_equal(rows.states[mine], state_rows(features[demo], labels, N_SUBTASKS))


def test_only_the_first_state_is_marked_as_start() -> None:
    rows = state_rows(np.ones((3, 2)), [0, 1, 2], N_SUBTASKS)
    assert rows[:, 1].tolist() == [1, 0, 0, 0]
    assert (rows[0, 2:] == 0).all()


def test_rows_are_read_only_and_of_equal_length() -> None:
    rows = transitions([np.ones((2, 2))], [[0, 1]], N_SUBTASKS)
    with pytest.raises(ValueError, match="read-only"):
        rows.states[0, 0] = 3.0
    with pytest.raises(ValueError, match="differ in length"):
        Transitions(np.ones((2, 1)), np.ones(3, np.int64), np.ones(2, np.int64), 1, 7)
