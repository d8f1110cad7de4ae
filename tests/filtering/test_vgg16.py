"""VGG-16 has the layers of the paper's network, takes weights by path, and looks as section 3.2."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.torch import save_file
from torch.nn import functional

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from filtering.features.checkpoint import load_features, save_features
from filtering.features.config import (
    BottleneckConfig,
    ClassifierConfig,
    GeneratorConfig,
    TrainingConfig,
)
from filtering.features.extraction import segment_features
from filtering.features.learned import LookConfig, learn_features
from filtering.vision import vgg16
from filtering.vision.frames import segment_indices
from filtering.vision.pretrained import Backbone
from teasim.common.errors import CheckpointError, ConfigError
from teasim.common.workers import IN_PROCESS
from teasim.pool import Pool, Span

CONVOLUTIONS = (0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28)
"""Numbers of the convolutions in torchvision's vgg16."""
CHANNELS = (3, 64, 64, 128, 128, 256, 256, 256, 512, 512, 512, 512, 512, 512)
POOLED_AFTER = (1, 3, 6, 9)
"""Convolutions that a pooling follows; the one after the last is left out."""


@pytest.fixture
def narrow(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The same network with few channels and small pictures, which is quick."""
    monkeypatch.setattr(vgg16, "BLOCKS", ((4, 2), (4, 2), (8, 3), (8, 3), (8, 3)))
    monkeypatch.setattr(vgg16, "SIZE", 32)
    vgg16.load_vgg16.cache_clear()
    yield
    vgg16.load_vgg16.cache_clear()


def state(seed: int = 0) -> dict[str, torch.Tensor]:
    torch.manual_seed(seed)
    return vgg16.VGG16().state_dict()


@pytest.fixture
def weights(narrow: None, tmp_path: Path) -> Path:
    path = tmp_path / "vgg16.pth"
    torch.save(state() | {"classifier.0.weight": torch.zeros(2, 2)}, path)
    return path


def test_layers_have_the_names_and_shapes_of_torchvision() -> None:
    with torch.device("meta"):
        found = {name: tuple(value.shape) for name, value in vgg16.VGG16().state_dict().items()}
    expected = {}
    for number, inputs, outputs in zip(CONVOLUTIONS, CHANNELS, CHANNELS[1:], strict=False):
        expected[f"features.{number}.weight"] = (outputs, inputs, 3, 3)
        expected[f"features.{number}.bias"] = (outputs,)
    assert found == expected


def test_features_are_those_of_the_last_convolution(weights: Path) -> None:
    frames = np.random.default_rng(0).integers(0, 256, (3, 32, 32, 3), np.uint8)
    images = torch.from_numpy(frames).permute(0, 3, 1, 2) / 255
    mean, deviation = torch.tensor(vgg16.MEAN), torch.tensor(vgg16.DEVIATION)
    maps = (images - mean[:, None, None]) / deviation[:, None, None]
    stored = state()
    for row, number in enumerate(CONVOLUTIONS):
        name = f"features.{number}"
        maps = functional.conv2d(maps, stored[f"{name}.weight"], stored[f"{name}.bias"], padding=1)
        maps = functional.relu(maps)
        maps = functional.max_pool2d(maps, 2) if row in POOLED_AFTER else maps
    found = vgg16.feature_maps(frames, weights)
    assert found.shape == (3, 8, 2, 2)
    assert torch.allclose(found, maps, atol=1e-5)
    pooled = vgg16.describe_frames(frames, weights)
    assert np.allclose(pooled[:, 8:], maps.amax(dim=(2, 3)).numpy(), atol=1e-5)


@pytest.mark.parametrize("form", ["safetensors", "bare names"])
def test_every_form_of_weights_gives_the_same_bits(weights: Path, tmp_path: Path, form) -> None:
    other = tmp_path / ("other.safetensors" if form == "safetensors" else "other.pt")
    if form == "safetensors":
        save_file(state(), other)
    else:
        torch.save({name.removeprefix("features."): v for name, v in state().items()}, other)
    frames = np.zeros((5, 20, 30, 3), np.uint8) + 50
    assert (vgg16.describe_frames(frames, weights) == vgg16.describe_frames(frames, other)).all()


def test_files_that_hold_no_vgg16_are_refused(narrow: None, tmp_path: Path) -> None:
    frames = np.zeros((1, 32, 32, 3), np.uint8)
    text, other, code = tmp_path / "a.pth", tmp_path / "b.pth", tmp_path / "c.pth"
    text.write_text("weights")
    torch.save({"features.0.weight": torch.zeros(2, 3, 3, 3)}, other)
    torch.save(torch.nn.Linear(1, 1), code)  # a pickle of code, which is never run
    for path in (text, code):
        with pytest.raises(ConfigError) as caught:
            vgg16.describe_frames(frames, path)
        assert str(caught.value) == (
            f"'{path}' cannot be read as weights; give a safetensors file or a state dict of torch "
            "with --backbone-weights."
        )
    with pytest.raises(ConfigError) as caught:
        vgg16.describe_frames(frames, other)
    assert str(caught.value) == (
        f"'{other}' holds no VGG-16: 'features.0.weight' of shape (4, 3, 3, 3) is missing; give "
        "the state dict of torchvision's vgg16 with --backbone-weights."
    )


def test_a_segment_has_exactly_as_many_frames_as_asked_for() -> None:
    short, long = segment_indices((Span("a", 10, 13), Span("b", 20, 220)), 64, exact=True)
    assert (len(short), len(long), len(set(long.tolist()))) == (64, 64, 64)
    assert np.bincount(short - 10).tolist() == [21, 22, 21]
    assert [len(i) for i in segment_indices((Span("a", 10, 13), Span("b", 20, 220)), 64)] == [3, 64]


def test_the_filter_looks_with_it_and_the_cache_tells_weights_apart(
    weights: Path, toy_pool: Pool, tmp_path: Path
) -> None:
    spans = [episode.spans() for episode in toy_pool.episodes]

    def features(backbone: Backbone) -> np.ndarray:
        found = segment_features(
            toy_pool,
            spans,
            cameras=("left",),
            frames_per_segment=2,
            background="median",
            workers=IN_PROCESS,
            backbone=backbone,
        )
        return np.concatenate(found)

    first = features(Backbone("vgg16", str(weights)))
    assert first.shape[1] == 4 * 8
    torch.save(state(1), tmp_path / "other.pth")
    assert not np.array_equal(first, features(Backbone("vgg16", str(tmp_path / "other.pth"))))
    config = FilterConfig(
        score="equation3",
        segmenter="logged",
        solver="published",
        groups="2",
        backbone="vgg16",
        backbone_weights=str(weights),
        frames_per_segment=2,
    )
    found = DemoFilter(config).fit(toy_pool)
    assert found.weights_.sum() == pytest.approx(3.5)


@pytest.mark.slow
def test_features_are_learned_from_its_maps_and_remember_it(
    weights: Path, toy_pool: Pool, tmp_path: Path
) -> None:
    look = LookConfig("left", 2, "none", Backbone("vgg16", str(weights)))
    quick = BottleneckConfig(channels=20, training=TrainingConfig(epochs=1))
    generator = GeneratorConfig(
        classifier=ClassifierConfig(hidden=8, training=TrainingConfig(epochs=1))
    )
    learned = learn_features(toy_pool.episodes[:2], toy_pool.subtasks, look, quick, generator)
    save_features(learned, tmp_path / "saved")
    assert load_features(tmp_path / "saved").look == look
    torch.save(state(1), weights)
    with pytest.raises(CheckpointError, match="was fitted to other feature maps"):
        load_features(tmp_path / "saved")


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"backbone": "vgg19"},
            "Unknown backbone 'vgg19'; choose efficientnet-lite0, vgg16.",
        ),
        (
            {"backbone": "vgg16", "backbone_weights": "none.pth"},
            "The backbone vgg16 needs weights, and there is no file 'none.pth'; give "
            "--backbone-weights FILE, the state dict of torchvision's vgg16.",
        ),
        (
            {"backbone_weights": "none.pth"},
            "The weights of efficientnet-lite0 are installed; leave out --backbone-weights or add "
            "--backbone vgg16.",
        ),
        (
            {"backbone": "vgg16", "score": "norm"},
            "The score 'norm' takes no backbone; choose equation3.",
        ),
    ],
)
def test_backbones_that_cannot_be_are_refused(settings: dict, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        FilterConfig(**{"score": "equation3"} | settings)
    assert str(caught.value) == message
