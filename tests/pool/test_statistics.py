import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from teasim.pool.lerobot.writing.statistics import (
    PIXEL_STRIDE,
    QUANTILES,
    ImageHistogram,
    column_stats,
    pool_histograms,
)

IMAGES = hnp.arrays(np.uint8, st.tuples(st.integers(1, 4), st.just(6), st.just(8), st.just(3)))


def histogram_of(images: np.ndarray) -> ImageHistogram:
    histogram = ImageHistogram()
    for image in images:
        histogram.add(image)
    return histogram


@settings(max_examples=30, deadline=None)
@given(IMAGES)
def test_image_statistics_are_those_of_the_pixels(images: np.ndarray) -> None:
    stats = histogram_of(images).stats()
    pixels = images[:, ::PIXEL_STRIDE, ::PIXEL_STRIDE].reshape(-1, 3) / 255
    expected = {
        "min": pixels.min(0),
        "max": pixels.max(0),
        "mean": pixels.mean(0),
        "std": pixels.std(0),
    }
    for name, level in QUANTILES.items():
        expected[name] = np.quantile(pixels, level, axis=0, method="inverted_cdf")
    for name, values in expected.items():
        assert np.asarray(stats[name]).shape == (3, 1, 1)
        np.testing.assert_allclose(np.ravel(stats[name]), values, atol=1e-7)
    assert stats["count"] == [len(images)]


@settings(max_examples=30, deadline=None)
@given(IMAGES, IMAGES)
def test_pooled_histograms_are_the_histogram_of_all(one: np.ndarray, other: np.ndarray) -> None:
    pooled = pool_histograms([histogram_of(one), histogram_of(other)])
    assert pooled.stats() == histogram_of(np.concatenate([one, other])).stats()


@pytest.mark.parametrize("shape", [(5,), (5, 3)])
def test_log_statistics_have_one_value_per_dimension(shape: tuple[int, ...]) -> None:
    values = np.random.default_rng(0).normal(size=shape)
    stats = column_stats(values)
    width = int(np.prod(shape[1:]))
    assert stats.pop("count") == [5]
    assert {len(block) for block in stats.values()} == {width}
    np.testing.assert_allclose(stats["mean"], values.reshape(5, -1).mean(0))
    np.testing.assert_allclose(stats["q50"], np.median(values.reshape(5, -1), axis=0))
