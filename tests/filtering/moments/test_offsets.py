"""How far a camera stood elsewhere."""

import numpy as np
import pytest

from filtering.moments.evidence.offsets import FARTHEST, Offset, offset_between, shifted_back
from filtering.moments.score import score_moments
from filtering.moments.vectors import Video
from tests.filtering.moments.toy_videos import STEPS, toy_video


def picture(seed, height=36, width=48):
    rng = np.random.default_rng(seed)
    coarse = rng.uniform(40, 200, (height // 6, width // 6, 3))
    return np.kron(coarse, np.ones((6, 6, 1))).astype(np.float32)


def moved(one, down, right):
    return np.roll(one, (down, right), axis=(0, 1))


@pytest.mark.parametrize("shift", [(0, 0), (2, -3), (-FARTHEST, FARTHEST), (1, 0)])
def test_a_shift_is_found_and_taken_back(shift):
    one = picture(0)
    other = moved(one, *shift) + np.random.default_rng(1).normal(0, 3, one.shape)
    found = offset_between(one, other.astype(np.float32))
    assert found == Offset(*shift)
    back = shifted_back(np.stack([moved(one, *shift)] * 2), found)
    inner = slice(FARTHEST, -FARTHEST)
    assert np.array_equal(back[1][inner, inner], one[inner, inner])


def test_other_light_and_a_thing_elsewhere_are_no_shift():
    one = picture(0)
    other = one + 10
    other[4:12, 30:38] = 255
    assert offset_between(one, other) == (0, 0)
    assert offset_between(one, picture(1)) == (0, 0)
    plain = np.full_like(one, 110)
    assert offset_between(plain, plain + np.random.default_rng(0).normal(0, 3, one.shape)) == (0, 0)


def test_small_pictures_have_no_offset():
    one = picture(0, 12, 48)
    assert offset_between(one, moved(one, 0, 3)) == (0, 0)


def test_a_camera_that_stood_elsewhere_accuses_nobody():
    """With the shift, what comes of steps lies farther off than the neighbourhood that counts."""
    videos = [toy_video(range(STEPS), seed) for seed in range(9)]
    around = picture(3, 42, 42)[:40, :40] / 4
    placed = []
    for number, video in enumerate(videos):
        cells = np.pad(video.cells.astype(float), ((0, 0), (11, 11), (8, 8), (0, 0)), mode="edge")
        cells = np.clip(cells + around, 0, 255)
        shift = 4 if number == 8 else 0
        placed.append(Video(video.looks, np.roll(cells, shift, axis=2).astype(np.uint8)))
    assert not score_moments({"front": placed}).flagged.any()
