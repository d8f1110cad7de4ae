"""Frames, background, backbone, cache and segment features."""

import os
from pathlib import Path

import numpy as np
import pytest
import torch

from filtering.features.extraction import segment_features
from filtering.features.reduction import MAX_COMPONENTS, reduce_features
from filtering.vision.backbone import FRAME_FEATURES, SameConv, describe_frames, load_backbone
from filtering.vision.background import GREY, subtraction_named
from filtering.vision.cache import ArrayCache
from filtering.vision.frames import fit_size, uniform_indices
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from teasim.pool import Pool


def test_uniform_indices_are_spread_over_the_whole_span() -> None:
    assert uniform_indices(3, 6, 64).tolist() == [3, 4, 5]
    found = uniform_indices(10, 110, 10)
    assert found.tolist() == list(range(15, 115, 10))
    assert len(set(uniform_indices(0, 65, 64))) == 64


def test_large_frames_shrink_and_small_ones_stay() -> None:
    assert fit_size(np.zeros((2, 480, 640, 3), np.uint8)).shape == (2, 224, 299, 3)
    small = np.zeros((2, 64, 64, 3), np.uint8)
    assert fit_size(small) is small


@pytest.fixture
def moving_square() -> np.ndarray:
    rng = np.random.default_rng(0)
    frames = np.full((20, 64, 64, 3), 90, np.uint8) + rng.integers(0, 5, (20, 64, 64, 3), np.uint8)
    for number, image in enumerate(frames):
        image[20:30, 2 * number : 2 * number + 10] = (220, 40, 40)
    return frames


@pytest.mark.parametrize("name", ["median", "mog2"])
def test_what_moves_is_kept_and_what_stands_still_becomes_grey(
    name: str, moving_square: np.ndarray
) -> None:
    found = subtraction_named(name)(moving_square, moving_square)
    assert (found[10, 22:28, 22:28] == (220, 40, 40)).all()
    assert (found[10, 40:, :] == GREY).mean() > 0.99
    assert found.shape == moving_square.shape


def test_without_background_subtraction_frames_stay(moving_square: np.ndarray) -> None:
    assert subtraction_named("none")(moving_square, moving_square) is moving_square


def test_unknown_background_is_refused_with_the_choices() -> None:
    with pytest.raises(ConfigError, match="'flow'; choose none, median, mog2"):
        subtraction_named("flow")


@pytest.mark.parametrize(
    ("size", "kernel", "stride"), [(224, 3, 2), (7, 5, 2), (8, 5, 2), (9, 3, 1)]
)
def test_padding_is_that_of_tensorflow(size: int, kernel: int, stride: int) -> None:
    """Output size ceil(size / stride); at even sizes the first window starts at the first pixel."""
    conv = SameConv(1, 1, kernel, stride, 1)
    with torch.no_grad():
        conv.conv.weight.fill_(1.0)
        assert conv.conv.bias is not None
        conv.conv.bias.zero_()
        found = conv(torch.ones(1, 1, size, size))[0, 0]
    assert found.shape == (-(-size // stride),) * 2
    total = max((found.shape[0] - 1) * stride + kernel - size, 0)
    assert found[0, 0] == (kernel - total // 2) ** 2


def test_backbone_has_the_published_maps_and_is_deterministic() -> None:
    frames = np.random.default_rng(0).integers(0, 255, (3, 96, 96, 3), np.uint8)
    with torch.inference_mode():
        maps = load_backbone()(torch.zeros(1, 3, 224, 224))
    assert [tuple(found.shape[1:]) for found in maps] == [(112, 14, 14), (320, 7, 7)]
    features = describe_frames(frames)
    assert features.shape == (3, FRAME_FEATURES)
    assert np.array_equal(features, describe_frames(frames))
    assert np.allclose(features[:1], describe_frames(frames[:1]), atol=1e-4)


def test_pretrained_weights_recognise_a_daisy() -> None:
    """Class 985 of ImageNet; wrong padding, scaling or folding loses it."""
    from sklearn.datasets import load_sample_image  # type: ignore[import-untyped]

    from filtering.vision.pretrained import weights_path

    picture = fit_size(load_sample_image("flower.jpg")[None, :, 107:534])
    stored = torch.load(weights_path(), weights_only=True)
    with torch.inference_mode():
        scaled = (torch.from_numpy(picture).permute(0, 3, 1, 2).float() - 127) / 128
        top = torch.nn.functional.conv2d(load_backbone()(scaled)[1], stored["_conv_head.weight"])
        mean, variance = stored["_bn1.running_mean"], stored["_bn1.running_var"]
        scale, shift = stored["_bn1.weight"], stored["_bn1.bias"]
        top = torch.nn.functional.batch_norm(top, mean, variance, scale, shift, eps=1e-3)
        top = top.clamp(0, 6).mean(dim=(2, 3))
        scores = top @ stored["_fc.weight"].T + stored["_fc.bias"]
    assert int(scores.argmax()) == 985


def test_cache_returns_what_was_stored_and_survives_damage(tmp_path: Path) -> None:
    cache = ArrayCache(tmp_path / "cache")
    assert cache.get("key") is None
    cache.put("key", np.arange(6.0).reshape(2, 3))
    found = cache.get("key")
    assert found is not None
    assert np.array_equal(found, np.arange(6.0).reshape(2, 3))
    (tmp_path / "cache" / "key.safetensors").write_bytes(b"damaged")
    assert cache.get("key") is None


def test_cache_forgets_the_longest_unused_beyond_its_limit(tmp_path: Path) -> None:
    cache = ArrayCache(tmp_path, limit=3600)
    for number, key in enumerate(["a", "b", "c"]):
        cache.put(key, np.zeros(125))
        os.utime(tmp_path / f"{key}.safetensors", (number, number))
    assert cache.get("a") is not None  # used again, so no longer the oldest
    cache.put("d", np.zeros(125))
    assert cache.get("b") is None
    assert cache.get("d") is not None
    assert not list(tmp_path.glob("*.partial"))


def test_a_cache_that_cannot_be_written_is_no_error(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("")
    cache = ArrayCache(blocked / "cache")
    cache.put("key", np.zeros(3))
    assert cache.get("key") is None


def test_features_do_not_depend_on_jobs_or_on_the_cache(
    toy_pool: Pool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    segments = [episode.spans()[:2] for episode in toy_pool.episodes[:2]]
    toy = _First(toy_pool, 2)

    def extract(workers: Workers) -> list[np.ndarray]:
        return segment_features(
            toy,  # type: ignore[arg-type]
            segments,
            cameras=("left",),
            frames_per_segment=3,
            background="median",
            workers=workers,
        )

    monkeypatch.setenv("TEASIM_CACHE", str(tmp_path / "one"))
    fresh, cached = extract(Workers(1)), extract(Workers(1))
    monkeypatch.setenv("TEASIM_CACHE", str(tmp_path / "two"))
    for found in (cached, extract(Workers(2))):
        assert all(np.array_equal(a, b) for a, b in zip(fresh, found, strict=True))


class _First:
    """The first demonstrations of a pool."""

    def __init__(self, pool: Pool, count: int) -> None:
        self.episodes = pool.episodes[:count]


def test_reduced_features_are_short_and_of_unit_mean_square() -> None:
    rng = np.random.default_rng(0)
    features = [rng.normal(size=(7, 100)).astype(np.float32) for _ in range(10)]
    reduced = reduce_features(features)
    stacked = np.vstack(reduced)
    assert [rows.shape for rows in reduced] == [(7, MAX_COMPONENTS)] * 10
    assert (stacked**2).sum(axis=1).mean() == pytest.approx(1.0)
    assert np.allclose(stacked.mean(axis=0), 0.0)


def test_features_that_say_nothing_are_left_out() -> None:
    rng = np.random.default_rng(0)
    features = [rng.normal(size=(4, 3)) for _ in range(3)]
    constant = [np.hstack([rows, np.full((4, 2), 5.0)]) for rows in features]
    for with_, without in zip(reduce_features(constant), reduce_features(features), strict=True):
        assert np.allclose(with_, without)
    assert (np.vstack(reduce_features([np.ones((2, 3))] * 2)) == 0).all()
