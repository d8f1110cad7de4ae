"""A weight table meets a pool: matched by demonstration, refused when it is not the pool's."""

from dataclasses import replace

import numpy as np
import pytest

from policies.data.moments import weighted_moments
from policies.data.weighting import demo_weights
from teasim.common.errors import ConfigError
from teasim.pool.weight_table import WeightRow, write_weight_table


@pytest.fixture
def rows(fake_pool):
    return [
        WeightRow(
            episode.demo_id, episode.index, 0.9 - 0.1 * i, float(i), i == 6, int(i == 6), "why"
        )
        for i, episode in enumerate(fake_pool.episodes)
    ]


@pytest.fixture
def table(tmp_path):
    def write(rows):
        write_weight_table(tmp_path / "weights.csv", rows)
        return tmp_path / "weights.csv"

    return write


def test_no_table_is_weight_1(fake_pool):
    np.testing.assert_array_equal(demo_weights(fake_pool, None, "ignore"), np.ones(7))


@pytest.mark.parametrize(
    ("use", "expected"),
    [
        ("discard", [1, 1, 1, 1, 1, 1, 0]),
        ("weight", [0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3]),
        ("ignore", [1] * 7),
    ],
)
def test_uses(fake_pool, rows, table, use, expected):
    np.testing.assert_allclose(demo_weights(fake_pool, table(rows), use), expected, atol=1e-12)


def test_rows_are_matched_by_demonstration_not_by_place(fake_pool, rows, table):
    weights = demo_weights(fake_pool, table(rows[::-1]), "discard")
    np.testing.assert_array_equal(weights, [1, 1, 1, 1, 1, 1, 0])


def sentence(*arguments):
    with pytest.raises(ConfigError) as error:
        demo_weights(*arguments)
    return str(error.value)


def test_an_unknown_use_names_the_choices(fake_pool):
    assert sentence(fake_pool, None, "drop") == (
        "Unknown use 'drop' of weights; choose discard, weight, ignore."
    )


def test_a_use_without_a_table_is_refused(fake_pool):
    assert sentence(fake_pool, None, "weight") == (
        "Use 'weight' needs a weight table; give one with --weights."
    )


def test_a_table_of_another_pool_is_refused(fake_pool, rows, table):
    path = table([replace(row, demo_id=f"v2-{place:016x}") for place, row in enumerate(rows)])
    assert sentence(fake_pool, path, "weight") == (
        f"The weight table '{path}' is for another pool: "
        f"it has no demonstration of '{fake_pool.root}'."
    )


def test_a_table_fits_the_same_videos_without_the_joint_log(human_pool, rows, table):
    np.testing.assert_array_equal(demo_weights(human_pool, table(rows), "weight"), [0.9])


def test_a_table_that_lacks_demonstrations_is_refused(fake_pool, rows, table):
    path = table([rows[0], *rows[3:]])
    assert sentence(fake_pool, path, "weight") == (
        f"The weight table '{path}' lacks 2 of the 7 demonstrations of '{fake_pool.root}', "
        "the first is episode 1."
    )


def test_a_table_that_leaves_nothing_is_refused(fake_pool, rows, table):
    path = table([WeightRow(r.demo_id, r.episode_index, 0.0, 1.0, True, 1, "") for r in rows])
    assert sentence(fake_pool, path, "discard") == (
        f"With use 'discard' the weight table '{path}' leaves no demonstration to learn from; "
        "choose another use (discard, weight, ignore)."
    )


def test_moments_are_those_of_the_weighted_set(samples):
    shares = np.where(samples.demos < 2, 1 / 12, 0.0)
    moments = weighted_moments(samples, shares)
    maps = samples.maps[samples.demos < 2].astype(np.float64)
    joints = samples.low_dim[samples.demos < 2].astype(np.float64)
    np.testing.assert_allclose(moments.map_mean, maps.mean(axis=(0, 1, 4, 5)), atol=1e-12)
    np.testing.assert_allclose(moments.map_deviation, maps.std(axis=(0, 1, 4, 5)), atol=1e-12)
    np.testing.assert_allclose(moments.low_dim_mean, joints.mean(axis=0), atol=1e-12)
    np.testing.assert_allclose(moments.low_dim_deviation, joints.std(axis=0), atol=1e-12)
