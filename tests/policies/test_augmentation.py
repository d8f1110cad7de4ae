"""Altered views: bounded, repeatable, and the frame itself always first."""

import numpy as np

from policies.data.features import LIGHT, NOISE, SHIFT, views


def test_the_first_view_is_the_frame_itself():
    frames = np.random.default_rng(0).integers(0, 256, (2, 40, 30, 3), dtype=np.uint8)
    seen = views(frames, 3, np.random.default_rng(1))
    assert seen.shape == (2, 4, 40, 30, 3)
    assert seen.dtype == np.uint8
    np.testing.assert_array_equal(seen[:, 0], frames)
    assert all((seen[:, copy] != frames).any() for copy in range(1, 4))


def test_no_copies_are_the_frames_alone():
    frames = np.zeros((2, 8, 8, 3), dtype=np.uint8)
    assert views(frames, 0, np.random.default_rng(0)).shape == (2, 1, 8, 8, 3)


def test_a_seed_repeats_the_views():
    frames = np.random.default_rng(0).integers(0, 256, (1, 40, 40, 3), dtype=np.uint8)
    one, two = (views(frames, 2, np.random.default_rng(5)) for _ in range(2))
    np.testing.assert_array_equal(one, two)


def test_a_dot_moves_no_further_than_the_shift_and_dims_no_more_than_the_light():
    frames = np.zeros((1, 100, 100, 3), dtype=np.uint8)
    frames[0, 50, 50] = 200
    seen = views(frames, 40, np.random.default_rng(0))[0, 1:]
    places = np.array([np.unravel_index(view[..., 0].argmax(), (100, 100)) for view in seen]) - 50
    peaks = seen.max(axis=(1, 2, 3))
    assert np.abs(places).max() <= 100 * SHIFT
    assert np.ptp(places, axis=0).min() > 5
    spread = 5 * NOISE
    assert 200 * (1 - LIGHT) - spread <= peaks.min()
    assert peaks.max() <= 200 * (1 + LIGHT) + spread
