"""HDF5 files of demonstrations: opened read-only, searched for pictures, and read as clips.

A file may be damaged in any way: every exception of h5py becomes one sentence, and no array is
read that claims much more than the file holds.
"""

import hashlib
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from teasim.common.errors import PoolError, TeasimError
from teasim.pool.clips.order import MAX_SIDE, ascending, gather, sample
from teasim.pool.clips.probe import version

SUFFIXES = (".hdf5", ".h5")
MOST_COMPRESSED = 2000
"""Most bytes that one stored byte stands for; deflate reaches 1032."""
LARGEST_CHUNK = 2**29
"""Most bytes of a chunk, which is read as a whole; one picture of 8192 x 8192 has 2**27.6."""
DEEPEST = 6
"""Levels of groups that are searched for pictures; groups may hold themselves."""
DIGEST_FRAMES = 8
"""Number of frames, spread evenly, that `DatasetClip.digest` reads."""
JPEG, PNG = b"\xff\xd8\xff", b"\x89PNG"


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open an HDF5 file for reading; whatever goes wrong inside the block is damage.

    Yields:
        `h5py.File`.

    Raises:
        PoolError: the file is missing or damaged, or h5py is not installed.
    """
    h5py = library(path)
    if not path.is_file():
        raise PoolError(f"The HDF5 file '{path}' is missing.")
    try:
        with h5py.File(path, "r", locking="best-effort") as file:
            yield file
    except TeasimError:
        raise
    except Exception as error:  # h5py raises OSError, RuntimeError, KeyError, ValueError and more
        raise PoolError(f"The HDF5 file '{path}' is damaged and cannot be read.") from error


def library(path: Path) -> Any:
    """Return the module h5py.

    Raises:
        PoolError: it is not installed, so that `path` cannot be read.
    """
    try:
        import h5py
    except ImportError as error:
        raise PoolError(
            f"'{path}' is an HDF5 file, which h5py reads; install it with "
            "`pip install teasim[hdf5]`."
        ) from error
    return h5py


def root_names(path: Path) -> frozenset[str]:
    """Return the names at the root of an HDF5 file; none if it cannot be read."""
    try:
        with opened(path) as file:
            return frozenset(file)
    except PoolError:
        return frozenset()


def files_in(path: Path) -> list[Path]:
    """Return the HDF5 files of a folder, or the file itself if it is one."""
    found = sorted(path.iterdir()) if path.is_dir() else [path]
    return [f for f in found if f.suffix in SUFFIXES and f.name[0] != "." and f.is_file()]


def group(parent: Any, name: str) -> Any:
    """Return the group `name` of a group; an empty mapping where there is none."""
    found = parent.get(name)
    return {} if found is None or not hasattr(found, "items") else found


def arrays(parent: Any, prefix: str = "", deepest: int = DEEPEST) -> Iterator[tuple[str, Any]]:
    """Yield the arrays below a group in order of their names, with their paths from there."""
    for name in sorted(parent):
        child = parent.get(name)
        if child is None:
            continue
        if hasattr(child, "shape"):
            yield prefix + name, child
        elif deepest:
            yield from arrays(child, f"{prefix}{name}/", deepest - 1)


def clips_in(path: Path, parent: Any) -> dict[str, "DatasetClip"]:
    """Return the pictures below a group by the path of their array, blanks for slashes.

    Raises:
        PoolError: an array claims more than the file holds.
    """
    if hasattr(parent, "shape"):
        found = {"observations": parent}
    else:
        found = {name.replace("/", "."): data for name, data in arrays(parent)}
    kinds = {name: (data, _form(data)) for name, data in found.items()}
    return {
        name: DatasetClip(path, data.name, _checked(path, data).shape[0], form)
        for name, (data, form) in kinds.items()
        if form is not None
    }


def logs_hash(path: Path, logs: Mapping[str, Any]) -> str:
    """Return a hash of arrays of numbers by name; others are passed over.

    Raises:
        PoolError: an array claims more than the file holds.
    """
    content = hashlib.sha256()
    for name in sorted(logs):
        data = logs[name]
        if data.dtype.kind in "fiub" and data.shape is not None and _form(data) is None:
            values = np.ascontiguousarray(_checked(path, data)[()], dtype="<f4")
            content.update(f"{name} {values.shape}\n".encode())
            content.update(values.tobytes())
    return content.hexdigest()


@dataclass(frozen=True)
class DatasetClip:
    """Pictures in an array of an HDF5 file, one row per frame."""

    path: Path
    """The HDF5 file."""
    dataset: str
    """Path of the array in it."""
    length: int
    """Number of frames."""
    form: str
    """HWC or CHW for pictures of 3 channels, encoded for the bytes of JPEG or PNG files."""

    def frames(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the frames `indices`; see `teasim.pool.source.Clip`."""
        return gather(self, indices)

    def stream(self, indices: Sequence[int] | np.ndarray) -> Iterator[np.ndarray]:
        """Yield the frames `indices`, which ascend; see `teasim.pool.source.Clip`."""
        shape = None
        for index, row in self._rows(ascending(self, indices)):
            image = self._image(index, row)
            if shape not in (None, image.shape):
                raise self._unreadable(index)
            shape = image.shape
            yield image

    def digest(self) -> str:
        """Return a hash of the length and of some stored pictures, spread evenly.

        Raises:
            PoolError: the file is missing or damaged.
        """
        return _digest(self, *version(self.path))

    def mp4(self) -> bytes | None:
        """Return None: no mp4 is stored."""
        return None

    def _rows(self, wanted: np.ndarray) -> Iterator[tuple[int, np.ndarray]]:
        with opened(self.path) as file:
            data = _checked(self.path, file[self.dataset])
            for index in wanted.tolist():
                yield index, np.asarray(data[index])

    def _image(self, index: int, row: np.ndarray) -> np.ndarray:
        if self.form == "encoded":
            try:
                return _decoded(row.astype(np.uint8).tobytes())
            except Exception as error:  # PyAV has children of OSError, ValueError and others
                raise self._unreadable(index) from error
        return np.ascontiguousarray(row.transpose(1, 2, 0) if self.form == "CHW" else row)

    def _unreadable(self, index: int) -> PoolError:
        return PoolError(
            f"The HDF5 file '{self.path}' is damaged: frame {index} of '{self.dataset}' is no "
            "readable picture."
        )


@lru_cache(maxsize=65536)
def _digest(clip: DatasetClip, mtime_ns: int, size: int) -> str:
    del mtime_ns, size
    content = hashlib.sha256(f"pictures {clip.length}\n".encode())
    for _, row in clip._rows(sample(clip.length, DIGEST_FRAMES)):
        content.update(f"{row.shape}\n".encode())
        content.update(row.astype(np.uint8).tobytes())
    return content.hexdigest()


def _form(data: Any) -> str | None:
    """Return how an array stores pictures; None if it holds none."""
    shape: tuple[int, ...] = data.shape or ()
    if 0 in shape:
        return None
    if data.dtype == np.uint8 and len(shape) == 4 and max(shape[1:]) <= MAX_SIDE:
        return "HWC" if shape[3] == 3 else "CHW" if shape[1] == 3 else None
    ragged = data.dtype.kind == "O" and data.dtype.metadata == {"vlen": np.dtype("uint8")}
    if (ragged and len(shape) == 1) or (data.dtype == np.uint8 and len(shape) == 2):
        head = np.asarray(data[0]).astype(np.uint8).tobytes()[:4]
        return "encoded" if head.startswith((JPEG, PNG)) else None
    return None


def _checked(path: Path, data: Any) -> Any:
    """Return the array if the file can hold what it claims.

    Raises:
        PoolError: it cannot.
    """
    claimed = int(np.prod([1, *(data.shape or ())], dtype=object)) * data.dtype.itemsize
    chunk = int(np.prod([1, *(data.chunks or ())], dtype=object)) * data.dtype.itemsize
    stored = min(data.id.get_storage_size(), path.stat().st_size)
    if claimed > MOST_COMPRESSED * stored or chunk > LARGEST_CHUNK:
        raise PoolError(
            f"The HDF5 file '{path}' is damaged: '{data.name}' claims {claimed} bytes but "
            f"{stored} are stored."
        )
    return data


def _decoded(content: bytes) -> np.ndarray:
    """Return the picture of a JPEG or PNG file, (H, W, 3) uint8 RGB."""
    import av

    av.logging.set_level(av.logging.PANIC)  # ffmpeg's own lines would bury the one sentence
    with av.open(io.BytesIO(content), "r") as box:
        size = box.streams.video[0].codec_context
        if max(size.width, size.height) > MAX_SIDE:
            raise ValueError("too large")
        image: np.ndarray = next(box.decode(video=0)).to_ndarray(format="rgb24")
    return image
