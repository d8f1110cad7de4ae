"""Who acts, told by the colours of what moves."""

import numpy as np
import pytest

from filtering.moments.peers.clusters import PARTS
from filtering.moments.peers.colours import actors_of, colours_of
from filtering.moments.vectors import Video

HEIGHT, WIDTH, LENGTH = 18, 24, 60
SKINS = {"light": (225, 180, 150), "dark": (90, 55, 35)}


def acted(skin, seed, *, bright=1.0, until=LENGTH):
    """A video in which a hand, 6 by 6 cells, is at another place at every moment."""
    rng = np.random.default_rng(seed)
    cells = rng.normal(150, 2, (LENGTH, HEIGHT, WIDTH, 3))
    cells[:, :, :, 2] -= 60
    for moment in range(until):
        row, column = rng.integers(HEIGHT - 6), rng.integers(WIDTH - 6)
        cells[moment, row : row + 6, column : column + 6] = SKINS[skin]
    for moment in range(until, LENGTH):
        cells[moment, 2:8, 2 + moment % 12 : 8 + moment % 12] = SKINS["light"]
    return Video(
        np.zeros((LENGTH, 3), np.float32), np.clip(cells * bright, 0, 255).astype(np.uint8)
    )


def grouped(actors):
    """Return the members of each group, so that numbers do not matter."""
    return {frozenset(np.flatnonzero(actors == one)) for one in np.unique(actors)}


@pytest.mark.parametrize("dark", [[], [4], [2, 7], [0, 3, 6, 9]])
def test_hands_of_other_colours_are_told_apart_however_few(dark):
    videos = [acted("dark" if d in dark else "light", d) for d in range(10)]
    expected = {frozenset(range(10)) - set(dark), frozenset(dark)} - {frozenset()}
    assert grouped(actors_of(videos)) == expected


def test_the_light_does_not_tell_hands_apart():
    videos = [acted("light", d, bright=0.6 + 0.04 * d) for d in range(8)]
    assert len(grouped(actors_of(videos))) == 1


def test_what_moves_for_a_part_of_a_video_is_no_other_hand():
    """A thing that is used in some steps, or an oven that was left on, is not who acts."""
    videos = [acted("light", d) for d in range(7)] + [acted("dark", 8, until=2 * LENGTH // 3)]
    assert len(grouped(actors_of(videos))) == 1


def test_what_was_put_down_moves_no_more():
    """In every other video a large thing is put down and stays; it moved for a moment only."""
    videos = []
    for d in range(8):
        parts = [acted("light", 10 * d + part) for part in range(5)]
        cells = np.concatenate([part.cells for part in parts])
        if d % 2:
            cells[-2 * LENGTH :, 2:12, 2:14] = (40, 60, 200)
        videos.append(Video(np.zeros((len(cells), 3), np.float32), cells))
    assert len(grouped(actors_of(videos))) == 1


def test_two_videos_are_not_told_apart():
    assert len(grouped(actors_of([acted("light", 0), acted("dark", 1)]))) == 1


def test_histograms_are_shares_and_of_nothing_where_nothing_moves():
    colours = colours_of(acted("dark", 0))
    assert colours.shape[0] == 1 + PARTS
    assert colours.sum(axis=1) == pytest.approx(np.ones(1 + PARTS), abs=0.05)
    still = Video(np.zeros((12, 3), np.float32), np.full((12, HEIGHT, WIDTH, 3), 90, np.uint8))
    assert not colours_of(still).any()
