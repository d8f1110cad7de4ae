"""The frames of one demonstration as encoded pictures in a parquet or HDF5 file."""

import hashlib
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.clips.hdf5 import opened_dataset
from teasim.pool.clips.order import ascending, check_size, digest_sample, file_version, gather

FORMATS = ("PNG", "JPEG", "WEBP")
"""Kinds of pictures that are read."""

BATCH = 64
"""At most this many encoded pictures are in memory at once."""


@dataclass(frozen=True)
class ImageClip:
    """The frames of one demonstration as PNG, JPEG or WebP pictures, one per row.

    A parquet column holds the bytes of the pictures, or structures with the field `bytes`, as
    LeRobot's image features. An HDF5 dataset holds one ragged uint8 array per row, or equally
    long rows that are filled up behind the picture.
    """

    path: Path
    """A file whose name ends in .parquet, or an HDF5 file."""
    name: str
    """Column of the parquet file, or dataset of the HDF5 file."""
    start: int
    """First row of the demonstration."""
    length: int
    """Number of frames of the demonstration."""

    def frames(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the frames `indices`; see `teasim.pool.source.Clip`."""
        return gather(self, indices)

    def stream(self, indices: Sequence[int] | np.ndarray) -> Iterator[np.ndarray]:
        """Yield the frames `indices`, which ascend; see `teasim.pool.source.Clip`."""
        wanted, shape = ascending(self, indices), None
        for index, content in zip(wanted.tolist(), self.stored(wanted), strict=True):
            image = _decoded(content, self.path, f"'{self.name}' of frame {index}")
            if shape not in (None, image.shape):
                raise PoolError(f"The pictures '{self.name}' of '{self.path}' differ in size.")
            shape = image.shape
            yield image

    def digest(self) -> str:
        """Return a hash of the length and the bytes of `order.DIGEST_FRAMES` encoded pictures.

        Raises:
            PoolError: The file is missing or damaged, or ends before the demonstration does.
        """
        return _digest(self, *file_version(self.path, "file"))

    def mp4(self) -> None:
        """Return nothing: no mp4 is stored."""

    def stored(self, wanted: np.ndarray) -> Iterator[bytes]:
        """Yield the encoded pictures `wanted`, which ascend."""
        parquet = self.path.suffix == ".parquet"
        read = _from_parquet if parquet else _from_hdf5
        count = 0
        for content in read(self.path, self.name, self.start + wanted):
            count += 1
            yield content
        if count < len(wanted):
            raise PoolError(
                f"The file '{self.path}' ends before frame {wanted[count]} of the {self.length} of "
                f"this demonstration."
            )


def _from_parquet(path: Path, name: str, rows: np.ndarray) -> Iterator[bytes]:
    """Yield the pictures in the ascending `rows`; row groups without any are passed over."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    if not path.is_file():
        raise PoolError(f"The file '{path}' is missing.")
    try:
        with pq.ParquetFile(path) as file:
            if name not in file.schema_arrow.names:
                raise PoolError(f"The file '{path}' has no column '{name}'.")
            sizes = [file.metadata.row_group(g).num_rows for g in range(file.num_row_groups)]
            first = 0
            for group, size in enumerate(sizes):
                inside = rows[(rows >= first) & (rows < first + size)] - first
                if inside.size:
                    yield from _from_group(file, group, name, inside)
                first += size
    except (OSError, pa.ArrowException) as error:
        raise PoolError(f"The file '{path}' is damaged and cannot be read.") from error


def _from_group(file: Any, group: int, name: str, rows: np.ndarray) -> Iterator[bytes]:
    first = 0
    for batch in file.iter_batches(BATCH, row_groups=[group], columns=[name]):
        inside = rows[(rows >= first) & (rows < first + len(batch))] - first
        for row in inside.tolist():
            value = batch.column(0)[row].as_py()
            stored = value.get("bytes") if isinstance(value, dict) else value
            yield stored if isinstance(stored, bytes) else b""
        first += len(batch)


def _from_hdf5(path: Path, name: str, rows: np.ndarray) -> Iterator[bytes]:
    with opened_dataset(path, name) as dataset:
        for row in rows.tolist():
            if row >= len(dataset):
                return
            yield np.asarray(dataset[row]).tobytes()


def _decoded(content: bytes, path: Path, what: str) -> np.ndarray:
    """Return an encoded picture as (H, W, 3) uint8 RGB."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(io.BytesIO(content), formats=FORMATS) as image:
            check_size(path, *image.size)
            if image.mode.startswith(("I", "F")):  # 16 or 32 bits: depth, not colours
                raise PoolError(f"The picture {what} in '{path}' has more than 8 bits per channel.")
            return np.asarray(image.convert("RGB"))
    except (OSError, ValueError, SyntaxError, UnidentifiedImageError) as error:
        raise PoolError(f"The picture {what} in '{path}' is damaged or missing.") from error


@lru_cache(maxsize=65536)
def _digest(clip: ImageClip, mtime_ns: int, size: int) -> str:
    del mtime_ns, size
    content = hashlib.sha256(f"images {clip.length}\n".encode())
    for stored in clip.stored(digest_sample(clip.length)):
        content.update(hashlib.sha256(stored).digest())
    return content.hexdigest()
