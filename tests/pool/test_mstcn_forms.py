"""Folders of action segmentation data sets in the forms that people have them."""

from pathlib import Path

import numpy as np
import pytest

from teasim.common.errors import ConfigError, PoolError
from teasim.pool import Span
from teasim.pool.mstcn.arrays import layout_of
from teasim.pool.mstcn.folder import MSTCNFolder
from teasim.pool.mstcn.labels import BACKGROUNDS, read_labels, read_mapping, video_name
from teasim.pool.readers.reader import ReadOptions
from teasim.pool.readers.registry import open_source
from teasim.pool.sequences import SequencePool

NAMES = ("cut tomato", "stir")
LABELS = [0, 0, 0, 1, 1]


def text(path: Path, content: str, encoding: str = "utf-8") -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode(encoding))
    return path


def folder(root: Path, frames: int = 5) -> Path:
    text(root / "mapping.txt", "0 cut\n1 stir\n")
    text(root / "groundTruth" / "a.txt", "cut\n" * (frames - 2) + "stir\n" * 2)
    (root / "features").mkdir()
    return root


@pytest.mark.parametrize(
    "content",
    [
        "0 cut tomato\n1 stir\n",
        "0\tcut tomato\n1\tstir\n",
        "\ufeff0 cut tomato\r\n1 stir\r\n",
        "# number name\n\n0   cut  tomato \n1 stir  \n\n",
        "1 stir\n0 cut tomato",
        "0 cut tomato\n1 stir\n2 SIL\n3 background\n4 action_start\n5 action_end\n",
    ],
)
def test_mappings(tmp_path: Path, content: str) -> None:
    assert read_mapping(text(tmp_path / "mapping.txt", content), BACKGROUNDS) == NAMES


@pytest.mark.parametrize(
    "content",
    [
        "cut tomato\ncut tomato\ncut tomato\nstir\nstir\n",
        "\ufeffcut tomato \r\ncut tomato\t\r\ncut  tomato\r\nstir\r\nstir\r\n\r\n",
        "# frames\ncut tomato\ncut tomato\ncut tomato\nstir\nstir",
        "### Frame level recognition: ###\ncut tomato cut tomato cut tomato stir stir",
        "### Recognized sequence: ###\ncut tomato stir\n### Score: ###\n-12.5\n"
        "### Frame level recognition: ###\ncut tomato cut tomato cut tomato stir stir\n",
        "cut tomato cut tomato cut tomato stir stir",
    ],
)
def test_labels(tmp_path: Path, content: str) -> None:
    assert read_labels(text(tmp_path / "a.txt", content), NAMES).tolist() == LABELS


def test_an_unknown_label_on_one_line_is_told(tmp_path: Path) -> None:
    path = text(tmp_path / "a", "### Frame level recognition: ###\nstir cut stir\n")
    with pytest.raises(PoolError) as caught:
        read_labels(path, NAMES)
    assert str(caught.value) == (
        f"Line 2 of '{path}' has the label 'cut', which mapping.txt lacks; it has cut tomato, stir."
    )


@pytest.mark.parametrize("label", BACKGROUNDS)
def test_background_is_no_sub_task(tmp_path: Path, label: str) -> None:
    root = folder(tmp_path)
    text(root / "mapping.txt", f"0 cut\n1 stir\n2 {label}\n")
    text(root / "groundTruth" / "a.txt", f"{label}\ncut\ncut\n{label}\nstir\n")
    source = open_source(root)
    assert source.subtasks == ("cut", "stir")
    assert source.episodes[0].spans() == (Span("cut", 1, 3), Span("stir", 4, 5))


def test_further_background_is_an_option(tmp_path: Path) -> None:
    root = folder(tmp_path)
    source = open_source(root, ReadOptions(background_label=("stir",)))
    assert source.subtasks == ("cut",)
    assert source.episodes[0].spans() == (Span("cut", 0, 3),)
    with pytest.raises(ConfigError) as caught:
        open_source(root, ReadOptions(background_label=("rest",)))
    assert str(caught.value) == f"'rest' is no label of '{root}'; choose from cut, stir."


@pytest.mark.parametrize(
    "place",
    ["predictions/a.txt", "predictions/a", "results/a", "results/split_1/a", "results/a.recog"],
)
def test_places_of_predictions(tmp_path: Path, place: str) -> None:
    root = folder(tmp_path)
    text(root / place, "### Frame level recognition: ###\ncut cut stir stir stir")
    text(root / place.replace("/a", "/.DS_Store"), "x")
    text(root / "results" / "scores.csv", "x")
    opened = MSTCNFolder.open(root)
    assert opened.videos == ("a",)
    assert opened.predictions("a").tolist() == [0, 0, 1, 1, 1]
    assert SequencePool.open(root).episodes[0].predicted_spans()[0] == Span("cut", 0, 2)


def test_predictions_of_a_video_with_a_dot_in_its_name(tmp_path: Path) -> None:
    root = folder(tmp_path)
    text(root / "groundTruth" / "P03.cam01.txt", "cut\nstir\n")
    text(root / "results" / "P03.cam01", "### Frame level recognition: ###\ncut stir")
    opened = MSTCNFolder.open(root)
    assert opened.videos == ("P03.cam01", "a")
    assert opened.predictions("P03.cam01").tolist() == [0, 1]


def test_two_files_about_one_video(tmp_path: Path) -> None:
    root = folder(tmp_path)
    for split in (1, 2):
        text(root / "results" / f"split_{split}" / "a", "cut")
    with pytest.raises(PoolError) as caught:
        MSTCNFolder.open(root)
    first, second = (root / "results" / f"split_{split}" / "a" for split in (1, 2))
    assert str(caught.value) == (
        f"'{first}' and '{second}' are both about the video 'a'; remove one of them."
    )


def test_names_of_files_with_the_suffix_of_the_video(tmp_path: Path) -> None:
    root = folder(tmp_path)
    text(root / "groundTruth" / "b.avi.txt", "cut\nstir\n")
    np.save(root / "features" / "b.npy", np.zeros((20, 2)))
    text(root / "splits" / "train.split1.bundle", "#bundle\nb.avi.txt\r\n./a.txt\n")
    opened = MSTCNFolder.open(root)
    assert opened.videos == ("a", "b")
    assert opened.features("b").shape == (2, 20)
    assert opened.split("train.split1") == ("b", "a")
    assert SequencePool.open(root).entries([1, 0]) == ["b.avi.txt", "a.txt"]
    assert [video_name(n) for n in ("a", "a.txt", "a.mp4.recog", "x.y.npy")] == ["a"] * 3 + ["x.y"]


@pytest.mark.parametrize("shape", [(20, 5), (5, 20), (1, 20, 5), (1, 5, 20), (20, 5, 1)])
def test_shapes_of_features(tmp_path: Path, shape: tuple[int, ...]) -> None:
    root = folder(tmp_path)
    want = np.arange(100, dtype=np.float32).reshape(5, 20)
    frames_first = tuple(n for n in shape if n != 1) == (5, 20)
    np.save(root / "features" / "a.npy", (want if frames_first else want.T).reshape(shape))
    opened = MSTCNFolder.open(root)
    np.testing.assert_array_equal(opened.features("a"), want)
    assert opened.notes() == ()


def test_features_as_long_as_they_are_many(tmp_path: Path) -> None:
    root = folder(tmp_path)
    want = np.arange(25, dtype=np.float32).reshape(5, 5)
    np.save(root / "features" / "a.npy", want)
    np.testing.assert_array_equal(MSTCNFolder.open(root).features("a"), want.T)
    assert open_source(root).notes == (
        f"Both axes of '{root / 'features' / 'a.npy'}', 5 x 5, fit its 5 labels; it is read as "
        "features by frames.",
    )


@pytest.mark.parametrize("frames", [85, 99, 103])
def test_labels_of_a_few_frames_more_or_less_than_features(tmp_path: Path, frames: int) -> None:
    root = folder(tmp_path, frames=100)
    np.save(root / "features" / "a.npy", np.zeros((2048, frames), np.float32))
    opened = MSTCNFolder.open(root)
    assert opened.features("a").shape == (min(frames, 100), 2048)
    assert opened.notes() == (
        f"In 1 of 1 videos of '{root}' labels and features differ by a few frames, and the longer "
        "is cut: a.",
    )


@pytest.mark.parametrize("frames", [50, 75, 130])
def test_features_at_another_rate_than_labels_are_refused(tmp_path: Path, frames: int) -> None:
    root = folder(tmp_path, frames=100)
    path = root / "features" / "a.npy"
    np.save(path, np.zeros((2048, frames), np.float32))
    with pytest.raises(PoolError) as caught:
        MSTCNFolder.open(root).features("a")
    assert str(caught.value) == (
        f"'{path}' has {frames} frames (shape (2048, {frames}), features by frames) but "
        "groundTruth/a.txt has 100 labels."
    )
    assert open_source(root).notes == (str(caught.value),)


def test_without_labels_features_are_features_by_frames() -> None:
    assert layout_of((3, 9), None) == (1, 9, True)
    assert layout_of((9, 3), 9) == (0, 9, True)
    assert layout_of((9, 3), 30) is None


def test_an_array_that_claims_more_than_the_file_is_not_allocated(tmp_path: Path) -> None:
    root = folder(tmp_path)
    path = root / "features" / "a.npy"
    np.save(path, np.zeros((20, 5), np.float32))
    claim = b"(2000000000000, 5), }"
    assert b"(20, 5), }           " in path.read_bytes()
    path.write_bytes(path.read_bytes().replace(b"(20, 5), }           ", claim))
    with pytest.raises(PoolError, match="are damaged: they are no array"):
        MSTCNFolder.open(root).features("a")
