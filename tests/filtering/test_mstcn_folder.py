"""Folders of action segmentation data sets are read as they are, or refused with a reason."""

from pathlib import Path

import numpy as np
import pytest

from filtering.segmentation.scoring import folder_pair
from teasim.common.errors import PoolError
from teasim.pool.mstcn.folder import MSTCNFolder, is_mstcn_folder, write_predictions
from tests.filtering.conftest import real_data


@pytest.fixture
def folder(tmp_path) -> Path:
    """Two videos of three labels; the second has features but no truth."""
    (tmp_path / "groundTruth").mkdir()
    (tmp_path / "features").mkdir()
    (tmp_path / "splits").mkdir()
    (tmp_path / "mapping.txt").write_text("2 stir\n1 pour\n0 background\n")
    (tmp_path / "groundTruth" / "one.txt").write_text("pour\npour\nbackground\nstir\n")
    np.save(tmp_path / "features" / "one.npy", np.arange(8, dtype=np.float32).reshape(2, 4))
    np.save(tmp_path / "features" / "two.npy", np.zeros((2, 5)))
    (tmp_path / "splits" / "train.split1.bundle").write_text("one.txt\n")
    return tmp_path


def refusal(action) -> str:
    with pytest.raises(PoolError) as caught:
        action()
    return str(caught.value)


def test_a_folder_is_read(folder):
    opened = MSTCNFolder.open(folder)
    assert is_mstcn_folder(folder)
    assert opened.names == ("pour", "stir")
    assert opened.videos == ("one", "two")
    assert opened.truth("one").tolist() == [0, 0, -1, 1]
    assert opened.truth("two") is None
    np.testing.assert_array_equal(opened.features("one"), [[0, 4], [1, 5], [2, 6], [3, 7]])
    assert opened.features("two").shape == (5, 2)
    assert opened.split("train.split1") == ("one",)


def test_what_is_written_reads_back(tmp_path):
    predicted = {"a": np.array([0, 1, -1]), "b": np.array([1])}
    truth = {"a": np.array([0, 1, 1])}
    posteriors = {"a": np.full((3, 2), 0.5, np.float32)}
    write_predictions(tmp_path, ("pour in", "stir"), predicted, truth, posteriors)
    opened = MSTCNFolder.open(tmp_path)
    assert opened.names == ("pour in", "stir")
    assert opened.predictions("b").tolist() == [1]
    pair = folder_pair(opened, "a")
    assert (pair.truth.tolist(), pair.predicted.tolist()) == ([0, 1, 1], [0, 1, -1])
    read = opened.posteriors("a")
    assert read is not None
    np.testing.assert_array_equal(read, posteriors["a"])
    assert opened.posteriors("b") is None
    np.save(tmp_path / "posteriors" / "b.npy", np.ones((2, 3)))
    assert refusal(lambda: opened.posteriors("b")) == (
        f"'{tmp_path / 'posteriors' / 'b.npy'}' has the shape (2, 3); mapping.txt and "
        "predictions/b.txt want (2, 1), labels by frames."
    )


def test_predictions_alone_are_enough(tmp_path):
    write_predictions(tmp_path, ("pour", "stir"), {"a": np.array([0, 1])}, {}, {})
    assert MSTCNFolder.open(tmp_path).videos == ("a",)


def test_a_folder_without_a_mapping(folder):
    (folder / "mapping.txt").unlink()
    assert refusal(lambda: MSTCNFolder.open(folder)) == (
        f"The folder '{folder}' has no mapping.txt, which an MS-TCN folder needs "
        "(lines 'number name')."
    )


@pytest.mark.parametrize("line", ["pour", "one pour", "0 ", "1 stir\n1 pour", "1 pour\n2 pour"])
def test_a_damaged_mapping(folder, line):
    (folder / "mapping.txt").write_text(line)
    lines = line.split("\n")
    assert refusal(lambda: MSTCNFolder.open(folder)) == (
        f"Line {len(lines)} of '{folder / 'mapping.txt'}' is '{lines[-1].rstrip()}'; "
        "a number and a name are needed, each new."
    )


def test_an_empty_mapping(folder):
    (folder / "mapping.txt").write_text("\n")
    assert refusal(lambda: MSTCNFolder.open(folder)) == (
        f"'{folder / 'mapping.txt'}' is empty; it needs lines 'number name'."
    )


def test_a_folder_without_videos(tmp_path):
    (tmp_path / "mapping.txt").write_text("0 pour\n")
    assert refusal(lambda: MSTCNFolder.open(tmp_path)) == (
        f"The folder '{tmp_path}' holds neither groundTruth/*.txt nor features/*.npy nor "
        "predictions/*.txt; it needs one of them."
    )


def test_an_unknown_label(folder):
    path = folder / "groundTruth" / "one.txt"
    path.write_text("pour\nstirr\n")
    assert refusal(lambda: MSTCNFolder.open(folder).truth("one")) == (
        f"Line 2 of '{path}' has the label 'stirr', which mapping.txt lacks; it has pour, stir."
    )


def test_an_empty_file(folder):
    path = folder / "groundTruth" / "one.txt"
    path.write_text("")
    assert refusal(lambda: MSTCNFolder.open(folder).truth("one")) == (
        f"'{path}' is empty; it needs one label per frame and line."
    )


def test_labels_that_are_no_text(folder):
    path = folder / "groundTruth" / "one.txt"
    path.write_bytes(b"\xff\xfe\x00")
    said = refusal(lambda: MSTCNFolder.open(folder).truth("one"))
    assert said == f"'{path}' is damaged: it is no text."


def test_missing_predictions(folder):
    assert refusal(lambda: MSTCNFolder.open(folder).predictions("one")) == (
        f"'{folder / 'predictions' / 'one.txt'}' cannot be read: No such file or directory."
    )


def test_features_of_another_length_than_the_labels(folder):
    path = folder / "features" / "one.npy"
    np.save(path, np.zeros((2, 9)))
    assert refusal(lambda: MSTCNFolder.open(folder).features("one")) == (
        f"'{path}' has 9 frames (shape (2, 9), features by frames) "
        "but groundTruth/one.txt has 4 labels."
    )


@pytest.mark.parametrize("content", [b"", b"\x93NUMPY", b"hello", None])
def test_damaged_features(folder, content):
    path = folder / "features" / "one.npy"
    path.write_bytes(path.read_bytes()[:-1] if content is None else content)
    assert refusal(lambda: MSTCNFolder.open(folder).features("one")) == (
        f"The features '{path}' are damaged: they are no array of floating-point numbers."
    )


def test_features_are_never_unpickled(folder):
    path = folder / "features" / "one.npy"
    np.save(path, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    assert refusal(lambda: MSTCNFolder.open(folder).features("one")).endswith(
        "are damaged: they are no array of floating-point numbers."
    )


def test_features_of_no_use(folder):
    path = folder / "features" / "one.npy"
    np.save(path, np.zeros(4))
    opened = MSTCNFolder.open(folder)
    assert refusal(lambda: opened.features("one")) == (
        f"The features '{path}' have the shape (4,); features by frames are needed."
    )
    np.save(path, np.full((2, 4), np.inf))
    assert refusal(lambda: opened.features("one")) == (
        f"The features '{path}' are not all finite numbers."
    )
    assert refusal(lambda: opened.features("three")) == (
        f"The features '{folder / 'features' / 'three.npy'}' are missing."
    )


def test_splits_that_are_not_there(folder):
    opened = MSTCNFolder.open(folder)
    assert refusal(lambda: opened.split("test.split1")) == (
        f"The folder '{folder}' has no split 'test.split1'; it has train.split1."
    )
    path = folder / "splits" / "train.split1.bundle"
    path.write_text("three.txt\n")
    assert refusal(lambda: opened.split("train.split1")) == (
        f"'{path}' names the video 'three', which is not in the folder."
    )


def test_truth_and_predictions_of_different_length(folder):
    (folder / "predictions").mkdir()
    (folder / "predictions" / "one.txt").write_text("pour\n")
    assert refusal(lambda: folder_pair(MSTCNFolder.open(folder), "one")) == (
        f"groundTruth/one.txt of '{folder}' has 4 labels but predictions/one.txt has 1."
    )


@pytest.mark.parametrize(("name", "videos", "labels"), [("50salads", 50, 19), ("tea_unh", 52, 7)])
def test_published_data_sets_are_read(name, videos, labels):
    opened = MSTCNFolder.open(real_data(name))
    assert len(opened.names) == labels
    truths = [opened.truth(video) for video in opened.videos]
    assert len(truths) >= videos
    assert set(np.concatenate(truths)) <= set(range(labels))
