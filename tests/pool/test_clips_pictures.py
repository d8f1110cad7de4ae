"""Pictures in parquet and HDF5: every layout gives the frames that were stored."""

import io
import pickle
import sys
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from PIL import Image

from teasim.common.errors import PoolError
from teasim.pool.clips import ArrayClip, ImageClip
from teasim.pool.clips.order import MAX_SIDE
from tests import barcode

N = 20
FRAMES = np.stack([barcode.bars(i) for i in range(N)])
NAME = "data/demo_0/obs/top"


def encoded(image: np.ndarray, kind: str) -> bytes:
    content = io.BytesIO()
    Image.fromarray(image).save(content, kind)
    return content.getvalue()


def parquet(path: Path, contents: list[bytes], *, structures: bool = True) -> ImageClip:
    path = path / "pictures.parquet"
    rows = [{"bytes": content, "path": f"{i}.png"} for i, content in enumerate(contents)]
    pq.write_table(pa.table({"top": rows if structures else contents}), path, row_group_size=7)
    return ImageClip(path, "top", 0, len(contents))


def ragged(path: Path, contents: list[bytes]) -> ImageClip:
    path = path / "ragged.hdf5"
    with h5py.File(path, "w") as file:
        rows = file.create_dataset(NAME, (len(contents),), dtype=h5py.vlen_dtype(np.uint8))
        for i, content in enumerate(contents):
            rows[i] = np.frombuffer(content, np.uint8)
    return ImageClip(path, NAME, 0, len(contents))


def filled_up(path: Path, contents: list[bytes]) -> ImageClip:
    path = path / "filled.hdf5"
    width = max(map(len, contents)) + 5
    rows = np.stack([np.frombuffer(c.ljust(width, b"\0"), np.uint8) for c in contents])
    with h5py.File(path, "w") as file:
        file[NAME] = rows
    return ImageClip(path, NAME, 0, len(contents))


def plain_bytes(path: Path, contents: list[bytes]) -> ImageClip:
    return parquet(path, contents, structures=False)


STORES = [parquet, plain_bytes, ragged, filled_up]


@pytest.mark.parametrize("kind", ["png", "jpeg", "webp"])
@pytest.mark.parametrize("store", STORES)
def test_pictures_come_back(
    tmp_path: Path, store: Callable[[Path, list[bytes]], ImageClip], kind: str
) -> None:
    clip = store(tmp_path, [encoded(image, kind) for image in FRAMES])
    read = clip.frames(range(N))
    if kind == "png":
        np.testing.assert_array_equal(read, FRAMES)
    assert barcode.numbers(read) == list(range(N))
    part = ImageClip(clip.path, clip.name, 5, 10)
    copy: ImageClip = pickle.loads(pickle.dumps(part))
    assert barcode.numbers(copy.frames([9, 0, 3, 3])) == [14, 5, 8, 8]
    assert barcode.numbers(copy.stream(range(10))) == list(range(5, 15))
    assert copy.digest() == part.digest() != clip.digest()
    assert clip.mp4() is None


def test_the_same_pictures_have_the_same_digest_wherever_they_are(tmp_path: Path) -> None:
    contents = [encoded(image, "png") for image in FRAMES]
    clips = [store(tmp_path, contents) for store in (parquet, ragged)]
    assert len({clip.digest() for clip in clips}) == 1


def test_grey_pictures_become_rgb(tmp_path: Path) -> None:
    clip = parquet(tmp_path, [encoded(image[:, :, 0], "png") for image in FRAMES])
    np.testing.assert_array_equal(clip.frames(range(N)), FRAMES)


def test_what_is_no_picture_is_told_with_its_frame(tmp_path: Path) -> None:
    contents = [encoded(FRAMES[0], "png"), b"no picture", b""]
    clip = parquet(tmp_path, contents)
    for index in (1, 2):
        with pytest.raises(PoolError) as caught:
            clip.frames([index])
        assert str(caught.value) == (
            f"The picture 'top' of frame {index} in '{clip.path}' is damaged or missing."
        )


def test_depth_pictures_are_refused(tmp_path: Path) -> None:
    clip = parquet(tmp_path, [encoded(np.zeros((4, 4), np.uint16), "png")])
    with pytest.raises(PoolError, match=r"has more than 8 bits per channel\.$"):
        clip.frames([0])


def test_huge_pictures_are_refused_before_they_are_decoded(tmp_path: Path) -> None:
    clip = parquet(tmp_path, [encoded(np.zeros((1, MAX_SIDE + 1), np.uint8), "png")])
    with pytest.raises(PoolError, match=rf"are {MAX_SIDE + 1} x 1 pixels; at most"):
        clip.frames([0])


def test_pictures_of_two_sizes_are_told(tmp_path: Path) -> None:
    clip = parquet(tmp_path, [encoded(FRAMES[0], "png"), encoded(FRAMES[1][:8], "png")])
    with pytest.raises(PoolError, match=r"^The pictures 'top' of '.*' differ in size\.$"):
        clip.frames([0, 1])


@pytest.mark.parametrize("store", STORES)
def test_a_demonstration_behind_the_end_is_told(
    tmp_path: Path, store: Callable[[Path, list[bytes]], ImageClip]
) -> None:
    clip = store(tmp_path, [encoded(image, "png") for image in FRAMES])
    late = ImageClip(clip.path, clip.name, 15, 10)
    with pytest.raises(PoolError, match=r"ends before frame 5 of the 10 of this demonstration\.$"):
        late.frames(range(10))
    with pytest.raises(IndexError):
        clip.frames([N])


def array(path: Path, values: np.ndarray, **options: object) -> ArrayClip:
    path = path / "arrays.hdf5"
    with h5py.File(path, "w") as file:
        file.create_dataset(NAME, data=values, **options)
    return ArrayClip(path, NAME, 0, len(values))


ARRAYS: dict[str, np.ndarray] = {
    "channels last": FRAMES,
    "channels first": np.moveaxis(FRAMES, 3, 1),
    "grey": FRAMES[:, :, :, 0],
    "one channel last": FRAMES[:, :, :, :1],
    "one channel first": np.moveaxis(FRAMES[:, :, :, :1], 3, 1),
    "with alpha": np.concatenate([FRAMES, np.full_like(FRAMES[..., :1], 9)], axis=3),
}


@pytest.mark.parametrize("layout", ARRAYS)
@pytest.mark.parametrize("options", [{}, {"chunks": True}, {"compression": "gzip"}])
def test_arrays_come_back(tmp_path: Path, layout: str, options: dict[str, object]) -> None:
    clip = array(tmp_path, ARRAYS[layout], **options)
    np.testing.assert_array_equal(clip.frames(range(N)), FRAMES)
    part = ArrayClip(clip.path, NAME, 4, 12)
    copy: ArrayClip = pickle.loads(pickle.dumps(part))
    assert barcode.numbers(copy.frames([11, 0, 5, 5])) == [15, 4, 9, 9]
    assert barcode.numbers(copy.stream(range(12))) == list(range(4, 16))
    assert copy.digest() == part.digest() != clip.digest()
    assert clip.mp4() is None


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (FRAMES / 255.0, "holds float64 numbers; pictures must be uint8."),
        (FRAMES[:, 0, :, 0], "has the shape (20, 64); pictures need (N, H, W, 3), (N, 3, H, W) or"),
        (np.zeros((2, 5, 6, 7), np.uint8), "has the shape (2, 5, 6, 7); pictures need"),
        (np.zeros((1, 1, MAX_SIDE + 1, 1), np.uint8), "pixels; at most 8192 x 8192 are read."),
    ],
)
def test_arrays_that_are_no_pictures_are_refused(
    tmp_path: Path, values: np.ndarray, message: str
) -> None:
    with pytest.raises(PoolError) as caught:
        array(tmp_path, values).frames([0])
    assert message in str(caught.value)


def test_an_array_that_is_too_short_is_told(tmp_path: Path) -> None:
    clip = array(tmp_path, FRAMES)
    with pytest.raises(PoolError, match=r"has 20 frames but the demonstration in it ends at frame"):
        ArrayClip(clip.path, NAME, 15, 10).frames([0])


CLIPS = [ArrayClip, ImageClip]


@pytest.mark.parametrize("kind", CLIPS)
def test_missing_and_damaged_files_are_told(
    tmp_path: Path, kind: type[ArrayClip] | type[ImageClip]
) -> None:
    for suffix in ("hdf5", "parquet"):
        path = tmp_path / f"x.{suffix}"
        clip = kind(path, NAME, 0, 3)
        with pytest.raises(PoolError, match=r"^The file '.*' is missing\.$"):
            clip.frames([0])
        with pytest.raises(PoolError, match=r"^The file '.*' is missing\.$"):
            clip.digest()
        path.write_bytes(b"garbage" * 100)
        with pytest.raises(PoolError, match=r"^The file '.*' is damaged and cannot be read\.$"):
            clip.frames([0])


@pytest.mark.parametrize("kind", CLIPS)
def test_an_unknown_dataset_is_told(
    tmp_path: Path, kind: type[ArrayClip] | type[ImageClip]
) -> None:
    path = array(tmp_path, FRAMES).path
    with pytest.raises(PoolError, match=r"^The file '.*' has no dataset 'data/demo_7'\.$"):
        kind(path, "data/demo_7", 0, 3).frames([0])


def test_without_h5py_the_command_that_installs_it_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    clip = array(tmp_path, FRAMES)
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(PoolError, match=r"install it with: pip install 'teasim\[hdf5\]'\.$"):
        clip.frames([0])
