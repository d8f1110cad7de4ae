"""The feature generator: activations and labels in, one short vector per segment out."""

import subprocess
import sys
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from filtering.features.config import ClassifierConfig, GeneratorConfig
from filtering.features.generator import FeatureGenerator
from teasim.common.errors import ConfigError
from tests.filtering.toy_intervals import (
    CHANNELS,
    PLACES,
    TELLING,
    TEST_CLIPS,
    TRAIN_CLIPS,
    TRAINING,
    ToyClips,
    toy_clips,
)

CONFIG = GeneratorConfig(kept_channels=2, classifier=ClassifierConfig(hidden=32, training=TRAINING))


@pytest.fixture(scope="module")
def fitted() -> FeatureGenerator:
    train = toy_clips(TRAIN_CLIPS, seed=0)
    return FeatureGenerator(CONFIG).fit(train.activations, train.labels)


@pytest.fixture(scope="module")
def held_out() -> ToyClips:
    return toy_clips(TEST_CLIPS, seed=100)


def accuracy(generator: FeatureGenerator, clips: ToyClips, erased: tuple[int, ...] = ()) -> float:
    left = [intervals.without(erased) for intervals in generator.intervals(clips.activations)]
    return float((generator.decide(left).argmax(axis=1) == clips.labels).mean())


def test_the_channels_that_tell_classes_apart_rank_first(fitted: FeatureGenerator) -> None:
    assert set(fitted.kept_.tolist()) == set(TELLING)
    assert fitted.importance_.shape == (len(PLACES), CHANNELS)


def test_the_top_channels_are_missed_more_than_others(
    fitted: FeatureGenerator, held_out: ToyClips
) -> None:
    whole = accuracy(fitted, held_out)
    without_top = accuracy(fitted, held_out, tuple(fitted.kept_.tolist()))
    others = [pair for pair in combinations(range(CHANNELS), 2) if pair != TELLING]
    without_others = [accuracy(fitted, held_out, pair) for pair in others]
    print(f"whole {whole}, without the top {without_top}, without other pairs {without_others}")
    assert whole >= 0.9
    assert without_top <= 0.4
    assert without_top <= np.mean(without_others) - 0.2


def test_features_are_one_row_per_segment_of_the_kept_channels(
    fitted: FeatureGenerator, held_out: ToyClips
) -> None:
    features = fitted.transform(held_out.activations)
    assert features.shape == (TEST_CLIPS, CHANNELS)
    dropped = sorted(set(range(CHANNELS)) - set(TELLING))
    assert not features[:, dropped].any()
    for row, activations in zip(features, held_out.activations, strict=True):
        assert np.array_equal(row[list(TELLING)], activations.max(axis=0)[list(TELLING)])


def test_prediction_agrees_with_the_decision(fitted: FeatureGenerator, held_out: ToyClips) -> None:
    found = fitted.predict(held_out.activations)
    assert accuracy(fitted, held_out) == (found == held_out.labels).mean()


def test_the_same_clips_give_the_same_bits_and_settings_stay() -> None:
    toy = toy_clips(16, seed=1)
    one, two = (FeatureGenerator(CONFIG).fit(toy.activations, toy.labels) for _ in range(2))
    assert np.array_equal(one.importance_, two.importance_)
    assert np.array_equal(one.kept_, two.kept_)
    assert one.config is CONFIG


def test_segments_may_differ_in_length() -> None:
    toy = toy_clips(16, seed=1)
    cut = [clip[: 40 + number] for number, clip in enumerate(toy.activations)]
    assert FeatureGenerator(CONFIG).fit(cut, toy.labels).transform(cut).shape == (16, CHANNELS)


@pytest.mark.parametrize(
    ("segment", "message"),
    [
        (
            np.zeros((64, 3)),
            "The activations of segment 1 have shape (64, 3); the generator reads (frames, 6).",
        ),
        (
            np.zeros((0, 6)),
            "The activations of segment 1 have shape (0, 6); the generator reads (frames, 6).",
        ),
        (np.full((9, 6), np.nan), "The activations of segment 1 are not all finite numbers."),
    ],
)
def test_activations_that_do_not_fit_are_refused(
    segment: np.ndarray, message: str, fitted: FeatureGenerator, held_out: ToyClips
) -> None:
    segments = [held_out.activations[0], segment]
    for use in (fitted.transform, fitted.predict, lambda s: FeatureGenerator().fit(s, [0, 1])):
        with pytest.raises(ConfigError) as caught:
            use(segments)
        assert str(caught.value) == message


def test_settings_out_of_range_are_refused_with_the_choices(held_out: ToyClips) -> None:
    with pytest.raises(ConfigError) as caught:
        FeatureGenerator().fit(held_out.activations, held_out.labels)
    assert str(caught.value) == "kept_channels is 16; choose 1 to 6, the number of channels."
    with pytest.raises(ConfigError, match=r"structure is 0; choose 1 or more frames\."):
        GeneratorConfig(structure=0)
    with pytest.raises(ConfigError, match=r"kept_channels is 0; choose 1 or more\."):
        GeneratorConfig(kept_channels=0)
    with pytest.raises(ConfigError, match=r"hidden is 0; choose 1 or more\."):
        ClassifierConfig(hidden=0)


@pytest.mark.parametrize(
    ("module", "unwanted"),
    [
        ("filtering.cli", {"torch_geometric"}),
        ("filtering.demo_filter", {"torch_geometric"}),
        ("filtering.features.generator", {"torch", "torch_geometric"}),
    ],
)
def test_graphs_are_loaded_when_they_are_used(module: str, unwanted: set[str]) -> None:
    program = f"import {module}, sys; print(*{{name.split('.')[0] for name in sys.modules}})"
    command = [sys.executable, "-c", program]
    loaded = subprocess.check_output(command, cwd=Path(__file__).parents[2], text=True)
    assert set(loaded.split()) & unwanted == set()
