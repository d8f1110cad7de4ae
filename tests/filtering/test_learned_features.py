"""Features are learned beside a segmenter, kept, and used by the filter."""

import json
from pathlib import Path

import numpy as np
import pytest

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.features.bottleneck import Bottleneck
from filtering.features.checkpoint import load_features
from filtering.features.config import (
    BottleneckConfig,
    ClassifierConfig,
    GeneratorConfig,
    TrainingConfig,
)
from filtering.features.extraction import frame_maps, segment_maps
from filtering.features.learned import LookConfig, learn_features
from filtering.features.pictures import overlay
from filtering.segmentation.config import FitConfig, MSTCNConfig
from filtering.segmentation.fit import fit_segmenter
from teasim.common.errors import CheckpointError, ConfigError
from teasim.common.workers import IN_PROCESS
from teasim.pool import Pool
from tests.toy_pool import make_toy_pool

QUICK = MSTCNConfig(
    epochs=1,
    channels=16,
    prediction_layers=2,
    refinement_stages=1,
    refinement_layers=2,
)


@pytest.fixture(scope="module")
def folder(toy_pool: Pool, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a segmenter with features."""
    out = tmp_path_factory.mktemp("learned") / "segmenter"
    config = FitConfig(episodes=(0, 1, 3), cameras=("cup",), features=True, network=QUICK)
    fit_segmenter(toy_pool.root, out, config)
    return out


def test_the_folder_of_a_segmenter_holds_all_that_was_learned(folder):
    stems = {"segmenter", "bottleneck", "generator"}
    assert {path.name for path in folder.iterdir()} == {
        f"{stem}.{suffix}" for stem in stems for suffix in ("json", "safetensors")
    }
    record = json.loads((folder / "segmenter.json").read_text())["record"]
    assert record["config"]["features"] is True


def test_a_segment_becomes_the_maximum_of_the_kept_channels(folder, toy_pool):
    learned = load_features(folder)
    episode = toy_pool.episodes[2]
    part = Pool.open(toy_pool.root)
    segments = [e.spans() for e in part.episodes]
    described = learned.describe(part, segments, workers=IN_PROCESS)
    assert [rows.shape for rows in described] == [(len(spans), 32) for spans in segments]
    left_out = np.setdiff1d(np.arange(32), learned.generator.kept_)
    assert len(left_out) == 16
    assert not np.vstack(described)[:, left_out].any()
    maps = segment_maps(episode.clip("cup"), episode.spans(), 64, "median")
    activations = learned.bottleneck.transform(maps)
    strongest = np.stack([segment.max(axis=0) for segment in activations])
    kept = learned.generator.kept_
    np.testing.assert_allclose(described[2][:, kept], strongest[:, kept], rtol=1e-6)


def test_what_was_learned_comes_back_and_decides_the_same(folder, toy_pool):
    episodes = [toy_pool.episodes[number] for number in (0, 1, 3)]
    fresh = learn_features(episodes, toy_pool.subtasks, LookConfig("cup"))
    loaded = load_features(folder)
    clips = segment_maps(episodes[0].clip("cup"), episodes[0].spans(), 64, "median")
    seen = fresh.bottleneck.transform(clips)
    for one, other in zip(seen, loaded.bottleneck.transform(clips), strict=True):
        np.testing.assert_array_equal(one, other)
    intervals = fresh.generator.intervals(seen)
    np.testing.assert_array_equal(
        loaded.generator.decide(intervals), fresh.generator.decide(intervals)
    )
    np.testing.assert_array_equal(loaded.generator.importance_, fresh.generator.importance_)


def test_the_filter_uses_learned_features(folder, toy_pool):
    config = FilterConfig(segmenter="logged", features=str(folder), score="equation3", groups="2")
    filtered = DemoFilter(config).fit(toy_pool)
    assert len(filtered.weights_) == len(toy_pool.episodes)
    # Equation 3 sees the segments through these features alone.
    pooled = DemoFilter(FilterConfig(segmenter="logged", score="equation3", groups="2")).fit(
        toy_pool
    )
    assert not np.array_equal(filtered.losses_, pooled.losses_)


def test_features_that_are_not_there_are_refused_with_the_choices(folder, toy_pool, tmp_path):
    with pytest.raises(ConfigError) as caught:
        FilterConfig(features="ranked")
    assert str(caught.value) == (
        "Unknown features 'ranked'; choose pooled or the folder of a segmenter that "
        "`teasim segment fit --features` made."
    )
    with pytest.raises(ConfigError) as unused:
        FilterConfig(features=str(tmp_path))
    assert str(unused.value) == "The score 'auto' takes no features; choose equation3."
    with pytest.raises(CheckpointError) as missing:
        DemoFilter(FilterConfig(segmenter="logged", features=str(tmp_path), score="equation3")).fit(
            toy_pool
        )
    assert str(missing.value) == (
        f"'{tmp_path}' holds no learned features: generator.json cannot be read."
    )
    sideways = make_toy_pool(tmp_path / "p", [toy_pool.subtasks] * 3, size=16, cameras=("left",))
    with pytest.raises(ConfigError) as other:
        DemoFilter(FilterConfig(segmenter="logged", features=str(folder), score="equation3")).fit(
            sideways
        )
    assert str(other.value) == (
        "The features were learned from the camera 'cup', which the pool "
        f"'{sideways.root}' lacks; it has left."
    )


@pytest.mark.parametrize(
    "fields",
    [{"look": None}, {"look": {"camera": "cup", "background": "x"}}, {"config": {}}],
)
def test_a_description_of_other_weights_is_refused(folder, tmp_path, fields):
    for path in folder.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    path = tmp_path / "generator.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))
    with pytest.raises(CheckpointError) as caught:
        load_features(tmp_path)
    assert str(caught.value) == f"'{path}' does not describe the weights beside it; train again."


def test_a_picture_shows_where_a_channel_looks():
    rng = np.random.default_rng(0)
    # A bright patch, up left in one class and down right in the other.
    frames = np.full((4, 64, 64, 3), 100, np.uint8)
    frames[:2, :24, :24] = (250, 40, 40)
    frames[2:, 40:, 40:] = (40, 40, 250)
    frames = (frames + rng.integers(0, 3, frames.shape)).astype(np.uint8)
    maps = frame_maps(frames)
    training = TrainingConfig(epochs=5, learning_rate=1e-2)

    bottleneck = Bottleneck(BottleneckConfig(4, training)).fit([maps[:2], maps[2:]], [0, 1])
    heat = bottleneck.channel_maps(maps, 1)
    assert heat.shape == (4, 4, 4)
    seen = bottleneck.transform([maps])[0][:, 1]
    bias = float(bottleneck.network_.reduce.bias[1].detach())
    np.testing.assert_allclose(heat.max(axis=(1, 2)) + bias, seen, rtol=1e-5)
    shown = overlay(bottleneck, frames, maps, 1).astype(int)
    frame = frames[int(heat.max(axis=(1, 2)).argmax())].astype(int)
    redder = (shown[..., 0] - shown[..., 2]) - (frame[..., 0] - frame[..., 2])
    row, column = np.unravel_index(heat[int(seen.argmax())].argmax(), (4, 4))
    patch = redder[row * 16 : row * 16 + 16, column * 16 : column * 16 + 16]
    assert patch.mean() > 1.5 * redder.mean()


def test_settings_reach_the_networks(toy_pool):
    training = TrainingConfig(epochs=1)
    learned = learn_features(
        toy_pool.episodes[:1],
        toy_pool.subtasks,
        LookConfig("cup", frames_per_segment=2, background="none"),
        BottleneckConfig(8, training),
        GeneratorConfig(kept_channels=3, classifier=ClassifierConfig("nodes", 4, training)),
    )
    assert len(learned.generator.kept_) == 3
    assert len(learned.generator.thresholds_) == 8
