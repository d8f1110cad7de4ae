"""The laws of the seven relations between two intervals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from filtering.features.graphs.relations import NO_RELATION, Relation, relation_matrix

# Few places, so that starts and stops often coincide.
intervals = st.lists(st.tuples(st.integers(0, 8), st.integers(1, 8)), min_size=1, max_size=8).map(
    lambda pairs: np.array([(start, start + length) for start, length in pairs])
)

EXAMPLES = {
    Relation.BEFORE: (0, 2),
    Relation.MEETS: (0, 3),
    Relation.OVERLAPS: (1, 5),
    Relation.DURING: (4, 6),
    Relation.FINISHES: (5, 8),
    Relation.STARTS: (3, 5),
    Relation.EQUALS: (3, 8),
}
"""For each relation an interval that lies so to [3, 8)."""

REVERSED = {
    Relation.BEFORE: (Relation.BEFORE, True),
    Relation.MEETS: (Relation.MEETS, True),
    Relation.OVERLAPS: (Relation.OVERLAPS, True),
    Relation.DURING: (Relation.DURING, False),
    Relation.FINISHES: (Relation.STARTS, False),
    Relation.STARTS: (Relation.FINISHES, False),
    Relation.EQUALS: (Relation.EQUALS, False),
}
"""What a relation becomes when time runs backwards, and whether it then holds the other way."""


def matrix(ends: np.ndarray) -> np.ndarray:
    return relation_matrix(ends[:, 0], ends[:, 1])


def test_there_are_seven_relations_with_an_example_each() -> None:
    assert [int(kind) for kind in Relation] == list(range(7))
    for kind, ends in EXAMPLES.items():
        found = matrix(np.array([ends, (3, 8)]))
        assert found[0, 1] == kind
        assert found[1, 0] == (kind if kind is Relation.EQUALS else NO_RELATION)


@given(intervals)
def test_any_two_intervals_are_in_one_relation_in_one_direction(ends: np.ndarray) -> None:
    found = matrix(ends)
    there, back = found, found.T
    equal = (ends[:, None] == ends[None, :]).all(axis=2)
    assert ((there == Relation.EQUALS) == equal).all()
    assert ((there != NO_RELATION) ^ (back != NO_RELATION) | equal).all()


@given(intervals)
def test_the_converse_is_the_same_relation_in_the_other_direction(ends: np.ndarray) -> None:
    assert np.array_equal(matrix(ends[::-1]), matrix(ends)[::-1, ::-1])


@given(intervals)
def test_backwards_in_time_relations_turn_into_their_mirror_images(ends: np.ndarray) -> None:
    found, mirrored = matrix(ends), matrix(-ends[:, ::-1])
    for (row, column), value in np.ndenumerate(found):
        if value != NO_RELATION:
            kind, turned = REVERSED[Relation(value)]
            assert mirrored[(column, row) if turned else (row, column)] == kind


@given(intervals, st.integers(-100, 100), st.integers(1, 9))
def test_neither_the_origin_nor_the_unit_of_time_matters(
    ends: np.ndarray, shift: int, scale: int
) -> None:
    assert np.array_equal(matrix(ends), matrix(ends * scale + shift))


def test_an_interval_that_does_not_last_is_refused() -> None:
    with pytest.raises(ValueError, match="an interval is empty"):
        matrix(np.array([(0, 2), (3, 3)]))
