"""How far what changes in one picture lies from what changes in another."""

import numpy as np
import pytest

from filtering.moments.effects.offsets import (
    FARTHEST,
    LEAST_GAIN,
    SATURATED,
    Offset,
    offset_between,
    shifted_back,
)
from filtering.moments.score import score_moments
from filtering.moments.vectors import Video
from tests.filtering.moments.toy_videos import STEPS, toy_video

MOMENTS, HEIGHT, WIDTH = 12, 36, 48


def changes(*places, size=4, amount=30.0):
    """How much cells change, (T, H, W), where at every place one thing changes, one by one."""
    found = np.zeros((MOMENTS, HEIGHT, WIDTH))
    for moment, (row, column) in enumerate(places):
        found[moment, row : row + size, column : column + size] = amount
    return found


SOME = [(12, 12), (20, 30), (10, 24), (16, 20)]


def elsewhere(down, right):
    return [(row + down, column + right) for row, column in SOME]


@pytest.mark.parametrize("shift", [(0, 0), (3, -4), (-FARTHEST, FARTHEST), (5, 0)])
def test_a_shift_is_found_however_much_changes_and_taken_back(shift):
    found = offset_between(changes(*SOME), changes(*elsewhere(*shift), amount=90.0))
    assert found == Offset(*shift)
    picture = np.random.default_rng(0).uniform(0, 255, (HEIGHT, WIDTH, 3)).astype(np.float32)
    moved = np.roll(picture, shift, axis=(0, 1))
    back = shifted_back(np.stack([moved] * 2), found)
    inner = slice(FARTHEST, -FARTHEST)
    assert np.array_equal(back[1][inner, inner], picture[inner, inner])


def test_a_step_without_effect_is_no_shift():
    assert offset_between(changes(*SOME), changes(*SOME[:3])) == (0, 0)
    assert offset_between(changes(*SOME), changes(*elsewhere(4, 4)[:3])) == (4, 4)


def test_things_that_lie_elsewhere_one_by_one_are_no_shift():
    apart = [(5, 0), (0, -5), (-5, 0), (0, 5)]
    places = [(r + down, c + right) for (r, c), (down, right) in zip(SOME, apart, strict=True)]
    assert offset_between(changes(*SOME[:2]), changes(SOME[0], places[1])) == (0, 0)
    assert offset_between(changes(*SOME), changes(*SOME[:3], places[3])) == (0, 0)


def test_where_nothing_changes_there_is_no_shift():
    assert offset_between(changes(), changes()) == (0, 0)
    assert offset_between(changes(*SOME), changes()) == (0, 0)
    never_at_once = changes(*SOME), changes(*SOME)[::-1]
    assert offset_between(*never_at_once) == (0, 0)


@pytest.mark.parametrize(("size", "shift"), [(1, (0, 0)), (2, (4, 0))])
def test_less_than_the_least_change_of_one_thing_is_no_shift(size, shift):
    one, other = (changes(place, size=size, amount=20.0) for place in (SOME[0], elsewhere(4, 0)[0]))
    assert (one * one).sum() < LEAST_GAIN if size == 1 else (one * one).sum() > LEAST_GAIN
    assert offset_between(one, other) == shift


def test_one_large_change_does_not_outweigh_the_others():
    one, other = changes(*SOME), changes(*elsewhere(4, 0))
    one[8, 2:6, 2:6] = other[8, 2:6, 2:6] = 250.0
    assert offset_between(one, other) == (4, 0)
    assert SATURATED < 250


def test_small_pictures_have_shifts_too():
    one = np.zeros((2, 6, 6))
    one[:, 1:3, 1:3] = 30.0
    assert offset_between(one, np.roll(one, (3, 3), axis=(1, 2))) == (3, 3)


def test_a_camera_that_stood_elsewhere_accuses_nobody():
    """With the shift, what comes of steps lies farther off than the neighbourhood that counts."""
    videos = [toy_video(range(STEPS), seed) for seed in range(9)]
    coarse = np.random.default_rng(3).uniform(10, 50, (7, 7, 3))
    around = np.kron(coarse, np.ones((6, 6, 1)))[:40, :40]
    placed = []
    for number, video in enumerate(videos):
        cells = np.pad(video.cells.astype(float), ((0, 0), (11, 11), (8, 8), (0, 0)), mode="edge")
        cells = np.clip(cells + around, 0, 255)
        shift = 4 if number == 8 else 0
        placed.append(Video(video.looks, np.roll(cells, shift, axis=2).astype(np.uint8)))
    assert not score_moments({"front": placed}).flagged.any()
