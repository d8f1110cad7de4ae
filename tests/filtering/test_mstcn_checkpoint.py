"""A saved segmenter comes back as it was, or not at all."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from filtering.segmentation.mstcn.checkpoint import load_segmenter, save_segmenter
from filtering.segmentation.mstcn.network import MSTCN, MSTCNShape
from filtering.segmentation.mstcn.segmenter import MSTCNSegmenter
from filtering.vision.frame_features import FrameSource
from teasim.common.errors import CheckpointError, ConfigError

SHAPE = {
    "features": 5,
    "labels": 3,
    "channels": 4,
    "prediction_layers": 2,
    "refinement_stages": 1,
    "refinement_layers": 2,
}


@pytest.fixture(scope="module")
def segmenter() -> MSTCNSegmenter:
    return MSTCNSegmenter(
        network=MSTCN(MSTCNShape(**SHAPE)).eval(),
        subtasks=("pour", "stir"),
        source=FrameSource(("left", "cup"), 5.0),
        scaling="video",
        shortest=(0.4, 0.8, 0.4),
        labelled=frozenset({"abc", "def"}),
    )


@pytest.fixture
def saved(segmenter, tmp_path):
    save_segmenter(segmenter, tmp_path / "s", {"metrics": {"unseen": {"accuracy": 80.0}}})
    return tmp_path / "s"


def test_a_saved_segmenter_says_the_same(segmenter, saved):
    features = np.random.default_rng(0).normal(size=(30, 5)).astype(np.float32)
    torch.manual_seed(3)
    before = torch.get_rng_state()
    loaded = load_segmenter(saved)
    assert torch.equal(torch.get_rng_state(), before)
    np.testing.assert_array_equal(loaded.posteriors(features), segmenter.posteriors(features))
    assert replace(loaded, network=segmenter.network) == segmenter


def test_the_description_says_how_it_came_about(saved):
    described = json.loads((saved / "segmenter.json").read_text())
    assert described["subtasks"] == ["pour", "stir"]
    assert described["record"]["metrics"]["unseen"]["accuracy"] == 80.0


def test_features_of_another_width_are_refused(segmenter):
    with pytest.raises(ConfigError) as caught:
        segmenter.posteriors(np.zeros((4, 7), np.float32))
    assert str(caught.value) == (
        "The video has 7 features per frame; the segmenter was fitted to 5."
    )


def change(folder, **fields):
    path = folder / "segmenter.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


def sentence(folder) -> str:
    with pytest.raises(CheckpointError) as caught:
        load_segmenter(folder)
    return str(caught.value)


def test_no_segmenter(tmp_path):
    assert sentence(tmp_path) == f"'{tmp_path}' holds no segmenter: segmenter.json cannot be read."


def test_missing_weights(saved):
    (saved / "segmenter.safetensors").unlink()
    assert sentence(saved) == f"'{saved}' holds no segmenter: segmenter.safetensors cannot be read."


@pytest.mark.parametrize("keep", [0, 10, -1])
def test_damaged_weights(saved, keep):
    path = saved / "segmenter.safetensors"
    path.write_bytes(path.read_bytes()[:keep])
    assert sentence(saved) == (
        f"'{path}' is damaged: it is not the file that was saved; fit again."
    )


@pytest.mark.parametrize("text", ["{", "\x00", ""])
def test_a_damaged_description(saved, text):
    path = saved / "segmenter.json"
    path.write_text(text)
    assert sentence(saved) == f"'{path}' is damaged: it is not JSON; fit again."


def test_another_kind_of_file(saved):
    change(saved, format="teasim-policy")
    assert sentence(saved) == (
        f"'{saved / 'segmenter.json'}' does not describe a segmenter of this program."
    )


def test_another_version(saved):
    change(saved, version=9)
    assert sentence(saved) == (
        f"'{saved / 'segmenter.json'}' has version 9, this program reads 2; fit again."
    )


def test_other_features(saved):
    change(saved, features=["vgg16", "0"])
    assert sentence(saved) == (
        f"'{saved / 'segmenter.json'}' was fitted to other features of a frame than this program "
        "computes; fit again."
    )


@pytest.mark.parametrize(
    "fields",
    [
        {"subtasks": ["a", "b", "c", "d"]},
        {"subtasks": ["a"]},
        {"network": {}},
        {"network": SHAPE | {"channels": 5}},
        {"network": SHAPE | {"channels": "wide"}},
        {"network": SHAPE | {"depth": 1}},
        {"source": None},
        {"source": {"cameras": [], "rate": 5.0}},
        {"source": {"cameras": ["left"], "rate": 0.0}},
        {"shortest": [0.4]},
        {"scaling": "none"},
        {"labelled": None},
    ],
)
def test_a_description_of_other_weights(saved, fields):
    change(saved, **fields)
    assert sentence(saved) == (
        f"'{saved / 'segmenter.json'}' does not describe the weights beside it; fit again."
    )
