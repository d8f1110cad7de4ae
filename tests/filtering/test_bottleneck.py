"""Feature maps to activations, learned, saved and loaded."""

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from filtering.features.bottleneck import Bottleneck
from filtering.features.checkpoint import load_bottleneck, save_bottleneck
from filtering.features.config import BottleneckConfig, TrainingConfig
from teasim.common.errors import CheckpointError, ConfigError

MAP_CHANNELS = 12
CONFIG = BottleneckConfig(channels=6, training=TrainingConfig(epochs=12, learning_rate=1e-2))


def toy_maps(clips: int, seed: int) -> tuple[list[np.ndarray], list[int]]:
    """Clips of three sub-tasks: a thing, anywhere in the picture, in some of the frames."""
    rng = np.random.default_rng(seed)
    found, labels = [], [number % 3 for number in range(clips)]
    for label in labels:
        maps = rng.normal(size=(rng.integers(4, 9), MAP_CHANNELS, 5, 5))
        row, column = rng.integers(5, size=2)
        maps[1:3, 3 * label : 3 * label + 3, row, column] += 4.0
        found.append(maps.astype(np.float16))
    return found, labels


@pytest.fixture(scope="module")
def fitted() -> Bottleneck:
    return Bottleneck(CONFIG).fit(*toy_maps(60, seed=0))


def test_it_learns_what_tells_sub_tasks_apart(fitted: Bottleneck) -> None:
    maps, labels = toy_maps(60, seed=1)
    assert (fitted.predict(maps) == labels).mean() >= 0.9
    assert len(fitted.history_) == CONFIG.training.epochs
    assert fitted.history_[-1] < 0.5 * fitted.history_[0]


def test_activations_have_a_row_per_frame_and_peak_where_the_thing_is(fitted: Bottleneck) -> None:
    maps, _ = toy_maps(12, seed=2)
    found = fitted.transform(maps)
    assert [rows.shape for rows in found] == [(len(clip), CONFIG.channels) for clip in maps]
    assert all(rows.dtype == np.float32 for rows in found)
    for rows in found:
        spread = np.abs(rows - np.median(rows, axis=0)).max(axis=1)
        assert set(np.argsort(spread)[-2:]) & {1, 2}


def test_where_in_the_picture_does_not_matter_and_frames_stay_apart(fitted: Bottleneck) -> None:
    (clip, *_), _ = toy_maps(3, seed=3)
    there = fitted.transform([clip])[0]
    assert np.array_equal(there, fitted.transform([clip[:, :, ::-1, ::-1]])[0])
    assert np.allclose(there[2:4], fitted.transform([clip[2:4]])[0], atol=1e-5)


def test_a_seed_gives_the_same_bits_and_leaves_the_callers_random_numbers(
    fitted: Bottleneck,
) -> None:
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    again = Bottleneck(CONFIG).fit(*toy_maps(60, seed=0))
    assert torch.equal(torch.rand(1), expected)
    assert again.history_ == fitted.history_
    for name, value in fitted.network_.state_dict().items():
        assert torch.equal(value, again.network_.state_dict()[name])


def test_the_unit_of_the_feature_maps_does_not_matter(fitted: Bottleneck) -> None:
    maps, labels = toy_maps(60, seed=0)
    scaled = [4 * clip.astype(np.float64) + 3 for clip in maps]
    other = Bottleneck(CONFIG).fit(scaled, labels)
    assert np.allclose(other.history_, fitted.history_, rtol=0.05)


@pytest.mark.parametrize(
    ("clip", "message"),
    [
        (
            np.zeros((4, 7, 5, 5)),
            "The feature maps of clip 1 have shape (4, 7, 5, 5); "
            "the bottleneck reads (frames, 12, height, width).",
        ),
        (
            np.zeros((0, 12, 5, 5)),
            "The feature maps of clip 1 have shape (0, 12, 5, 5); "
            "the bottleneck reads (frames, 12, height, width).",
        ),
        (
            np.full((4, 12, 5, 5), np.nan),
            "The feature maps of clip 1 are not all finite numbers.",
        ),
    ],
)
def test_maps_that_do_not_fit_are_refused(
    clip: np.ndarray, message: str, fitted: Bottleneck
) -> None:
    clips = [toy_maps(1, seed=0)[0][0], clip]
    for use in (fitted.transform, fitted.predict, lambda c: Bottleneck(CONFIG).fit(c, [0, 1])):
        with pytest.raises(ConfigError) as caught:
            use(clips)
        assert str(caught.value) == message


def test_settings_that_cannot_train_are_refused() -> None:
    for make, message in (
        (lambda: BottleneckConfig(channels=0), "channels is 0; choose 1 or more."),
        (
            lambda: TrainingConfig(epochs=0),
            "epochs is 0 and batch is 8; choose 1 or more for both.",
        ),
        (
            lambda: TrainingConfig(learning_rate=float("nan")),
            "learning_rate is nan; choose a number above 0.",
        ),
        (lambda: TrainingConfig(weight_decay=-1.0), "weight_decay is -1.0; choose 0 or more."),
    ):
        with pytest.raises(ConfigError) as caught:
            make()
        assert str(caught.value) == message


def test_what_is_saved_comes_back_to_the_bit(fitted: Bottleneck, tmp_path: Path) -> None:
    save_bottleneck(fitted, tmp_path / "new")
    loaded = load_bottleneck(tmp_path / "new")
    assert loaded.config == fitted.config
    assert loaded.history_ == fitted.history_
    maps, _ = toy_maps(6, seed=4)
    for found, wanted in zip(loaded.transform(maps), fitted.transform(maps), strict=True):
        assert np.array_equal(found, wanted)
    assert np.array_equal(loaded.predict(maps), fitted.predict(maps))
    assert {path.name for path in (tmp_path / "new").iterdir()} == {
        "bottleneck.json",
        "bottleneck.safetensors",
    }


def damage_weights(folder: Path) -> None:
    path = folder / "bottleneck.safetensors"
    path.write_bytes(path.read_bytes()[:-1] + b"x")


def describe(**changes: object) -> object:
    def change(folder: Path) -> None:
        path = folder / "bottleneck.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | changes))

    return change


@pytest.mark.parametrize(
    ("harm", "message"),
    [
        (damage_weights, "bottleneck.safetensors' is damaged: it is not the file that was saved"),
        (lambda folder: (folder / "bottleneck.json").unlink(), "bottleneck.json cannot be read."),
        (
            lambda folder: (folder / "bottleneck.safetensors").unlink(),
            "holds no trained bottleneck: bottleneck.safetensors cannot be read.",
        ),
        (
            lambda folder: (folder / "bottleneck.json").write_text("{"),
            "bottleneck.json' is damaged: it is not JSON; train again.",
        ),
        (describe(format="other"), "does not describe a bottleneck of this program."),
        (describe(version=2), "has version 2, this program reads 1; train again."),
        (describe(inputs=3), "does not describe the weights beside it; train again."),
        (describe(config={}), "does not describe the weights beside it; train again."),
    ],
)
def test_a_damaged_bottleneck_is_refused(
    harm, message: str, fitted: Bottleneck, tmp_path: Path
) -> None:
    save_bottleneck(fitted, tmp_path)
    harm(tmp_path)
    with pytest.raises(CheckpointError) as caught:
        load_bottleneck(tmp_path)
    assert message in str(caught.value)
