"""The frames of one demonstration as an array of pixels in an HDF5 file."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.clips.hdf5 import opened_dataset
from teasim.pool.clips.order import ascending, check_size, digest_sample, file_version, gather

BLOCK = 32
"""At most this many frames are in memory at once."""


@dataclass(frozen=True)
class ArrayClip:
    """The frames of one demonstration in a uint8 dataset.

    The dataset has the shape (N, H, W, 3), (N, 3, H, W), or the same with one channel (grey) or
    four (the fourth, alpha, is left out), or (N, H, W). Numbers of another type are refused,
    because their range is not known.
    """

    path: Path
    """The HDF5 file."""
    name: str
    """Dataset in the file, e.g. 'data/demo_0/obs/agentview_image'."""
    start: int
    """First row of the demonstration."""
    length: int
    """Number of frames of the demonstration."""

    def frames(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the frames `indices`; see `teasim.pool.source.Clip`."""
        return gather(self, indices)

    def stream(self, indices: Sequence[int] | np.ndarray) -> Iterator[np.ndarray]:
        """Yield the frames `indices`, which ascend; see `teasim.pool.source.Clip`."""
        for row in self._rows(ascending(self, indices)):
            yield _as_rgb(row)

    def digest(self) -> str:
        """Return a hash of length, shape and pixels of `order.DIGEST_FRAMES` frames.

        Raises:
            PoolError: The file is missing or damaged, or the dataset does not fit.
        """
        return _digest(self, *file_version(self.path, "file"))

    def mp4(self) -> None:
        """Return nothing: no mp4 is stored."""

    def _rows(self, wanted: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the stored pictures, block by block, so that a chunk is unpacked once."""
        with opened_dataset(self.path, self.name) as dataset:
            self._check(dataset)
            chunk = dataset.chunks[0] if dataset.chunks else 1
            rows = self.start + wanted
            for block in np.split(rows, np.flatnonzero(np.diff(rows // min(chunk, BLOCK))) + 1):
                if block.size:
                    stored = dataset[block[0] : block[-1] + 1]
                    yield from stored[block - block[0]]

    def _check(self, dataset: Any) -> None:
        where = f"The dataset '{self.name}' of '{self.path}'"
        if dataset.dtype != np.uint8:
            raise PoolError(f"{where} holds {dataset.dtype} numbers; pictures must be uint8.")
        shape = dataset.shape
        if len(shape) != 3 and not (len(shape) == 4 and {shape[1], shape[3]} & {1, 3, 4}):
            raise PoolError(
                f"{where} has the shape {shape}; pictures need (N, H, W, 3), (N, 3, H, W) or "
                f"(N, H, W)."
            )
        check_size(self.path, max(shape[1:]), max(shape[1:]))
        if shape[0] < self.start + self.length:
            raise PoolError(
                f"{where} has {shape[0]} frames but the demonstration in it ends at frame "
                f"{self.start + self.length}."
            )


def _as_rgb(image: np.ndarray) -> np.ndarray:
    """Return (H, W), (H, W, C) or (C, H, W) as (H, W, 3); C is 1, 3 or 4."""
    if image.ndim == 2:
        image = image[:, :, None]
    elif image.shape[2] not in (1, 3, 4):
        image = np.moveaxis(image, 0, 2)
    if image.shape[2] == 1:
        image = np.repeat(image, 3, axis=2)
    return np.ascontiguousarray(image[:, :, :3])


@lru_cache(maxsize=65536)
def _digest(clip: ArrayClip, mtime_ns: int, size: int) -> str:
    del mtime_ns, size
    content = hashlib.sha256(f"array {clip.length}\n".encode())
    for row in clip._rows(digest_sample(clip.length)):
        content.update(f"{row.shape}\n".encode())
        content.update(row.tobytes())
    return content.hexdigest()
