import numpy as np
import pytest

from filtering.moments.evidence.effects import CELLS_SHARE, OTHER_COLOUR, usual_change
from filtering.moments.evidence.recurring import recurrences

TABLE, HAND, CUP = (150.0, 100.0, 50.0), (220.0, 180.0, 150.0), (60.0, 60.0, 200.0)


def as_usual(colour, height=6, width=8):
    """Return the change of all cells from the table to a colour."""
    change = np.zeros((height, width, 3), dtype=np.float32)
    change[:] = np.subtract(colour, TABLE)
    return change


def usual_of(change):
    usual = usual_change(0, np.stack([change] * 5), np.stack([change] * 5))
    assert usual is not None
    return usual


def test_all_of_a_usual_change_is_there():
    change = as_usual(HAND)
    size = np.linalg.norm(change[0, 0])
    assert usual_of(change).amounts(change) == pytest.approx(np.full(48, size), rel=1e-4)


def test_a_change_into_another_colour_counts_in_part():
    dark = as_usual(np.subtract(TABLE, 60.0))
    size = np.linalg.norm(dark[0, 0])
    there = usual_of(as_usual(HAND)).amounts(dark)
    assert there == pytest.approx(np.full(48, OTHER_COLOUR * size), rel=1e-4)


def test_nothing_of_a_change_is_there_where_nothing_changes():
    assert not usual_of(as_usual(CUP)).amounts(np.zeros((6, 8, 3), np.float32)).any()


def test_cells_that_are_left_out_do_not_count():
    usual = usual_of(as_usual(CUP))
    left_out = np.arange(48) < 40
    kept = usual.but(left_out)
    assert kept is not None
    assert len(kept.rows) == 8
    assert usual.but(np.arange(48) < 45) is None
    assert 0 < CELLS_SHARE <= 1


def seen_as(*colours, stay=10):
    """Return (n, 1, 3): a cell that looks like each colour for a while."""
    return np.repeat(np.array(colours, dtype=np.float64), stay, axis=0)[:, None]


@pytest.mark.parametrize(
    ("colours", "times"),
    [
        ((TABLE, CUP), 1),
        ((TABLE, CUP, TABLE, CUP), 2),
        ((TABLE, HAND, TABLE, HAND, TABLE, HAND), 3),
        ((CUP, TABLE, CUP, TABLE, CUP), 2),
    ],
)
def test_a_change_recurs_as_often_as_it_comes_about(colours, times):
    places = seen_as(*colours)
    last = len(places) - 10
    assert recurrences(places, last, reach=5).tolist() == [times]


def test_what_covers_a_cell_for_a_while_is_no_recurrence():
    places = seen_as(TABLE, CUP, HAND, CUP, HAND, CUP)
    assert recurrences(places, 10, reach=5).tolist() == [1]


def test_a_cell_that_does_not_change_has_no_recurrences():
    places = seen_as(TABLE, TABLE, TABLE)
    assert recurrences(places, 15, reach=5).tolist() == [0]
