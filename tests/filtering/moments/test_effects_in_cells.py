from dataclasses import replace

import numpy as np
import pytest

from filtering.moments.counterparts import compare
from filtering.moments.effects.lacking import DOUBTFUL, View
from filtering.moments.effects.observed import observe
from filtering.moments.effects.recurring import recurrences
from filtering.moments.effects.usual_changes import OTHER_COLOUR, usual_change
from filtering.moments.peers.peers import everybody
from tests.filtering.moments.toy_videos import HEIGHT, STEPS, toy_video

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


@pytest.mark.parametrize(("columns", "share"), [(1, OTHER_COLOUR), (2, 0.0)])
def test_another_colour_counts_in_the_next_cells_alone(columns, share):
    usual = usual_of(as_usual(HAND)).but(np.arange(48) % 8 != 0)
    assert usual is not None
    assert usual.columns.tolist() == [0] * 6
    dark = as_usual(np.subtract(TABLE, 60.0))
    size = np.linalg.norm(dark[0, 0])
    dark[:, np.arange(8) != columns] = 0.0
    assert usual.amounts(dark) == pytest.approx(np.full(6, share * size), rel=1e-4)


def test_nothing_of_a_change_is_there_where_nothing_changes():
    assert not usual_of(as_usual(CUP)).amounts(np.zeros((6, 8, 3), np.float32)).any()


def test_cells_that_are_left_out_do_not_count():
    usual = usual_of(as_usual(CUP))
    left_out = np.arange(48) < 40
    kept = usual.but(left_out)
    assert kept is not None
    assert len(kept.rows) == 8
    assert usual.but(np.arange(48) < 45) is None


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


def test_where_a_hand_comes_back_to_rest_there_is_no_usual_change():
    rest = HEIGHT - 5  # the squares of the steps lie above it
    videos = [toy_video(range(STEPS), seed, tempo=3.0) for seed in range(5)]
    for video in videos:
        for moment, cells in enumerate(video.cells):
            if moment / len(video.cells) * STEPS % 1 < 0.5:
                cells[rest:, :6] = HAND
    found = compare([video.looks for video in videos], range(5))
    changes = [usual for view in observe(found, videos).views for usual in view.usual]
    shown = [bool((usual.rows >= rest).any()) for usual in changes]
    assert np.mean(shown) < 0.2  # at the edges of a rest it is not always told


SIZE = 100.0
"""How much of the usual change a video shows that shows all of it."""


def lacked(shown):
    """Return (D,): the most that is lacking, of (D, C) how much is shown for a while."""
    usual = usual_of(as_usual(CUP))
    amounts = tuple(np.array(shown, dtype=np.float32) for _ in range(6))
    return View(0, (usual,) * 6, amounts).lacks(everybody(np.zeros(len(shown), int))).max(axis=0)


def test_who_lacks_a_quarter_of_a_usual_change_lacks_it():
    found = []
    for cells in (4, 12, 48):
        shown = np.full((10, 48), SIZE)
        shown[3, :cells] = 0.0
        assert lacked(shown).argmax() == 3
        found.append(lacked(shown)[3])
    assert found[0] < found[1] / 2
    assert found[1] == found[2]


def test_it_is_doubtful_what_a_video_shows_whose_counterparts_do_not_lead_back():
    videos = [toy_video(range(STEPS), seed) for seed in range(5)]
    found = compare([video.looks for video in videos], range(5))
    astray = tuple(
        tuple(
            match._replace(at=(match.at + 2 * DOUBTFUL) % length) if match and d == 1 else match
            for d, match in enumerate(row)
        )
        for row, length in zip(found.back, found.lengths, strict=True)
    )
    for view in observe(replace(found, back=astray), videos).views:
        for amounts in view.amounts:
            assert np.isnan(amounts[1]).all() == (found.references[view.row] != 1)
            assert not np.isnan(amounts[view.row]).any()


def test_nothing_is_lacking_where_it_is_doubtful_what_a_video_shows():
    shown = np.full((10, 8), SIZE)
    shown[3] = np.nan
    assert (lacked(shown) <= 0).all()


def test_nobody_is_accused_of_what_is_doubtful_in_others():
    shown = np.full((10, 8), SIZE)
    shown[3] = 0.0
    assert lacked(shown)[3] > 1
    shown[[1, 5, 6]] = np.nan
    assert lacked(shown)[3] <= 0
