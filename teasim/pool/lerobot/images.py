"""Pictures stored in the log itself, in rows that may stand in any order."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from teasim.pool.clips import ImageClip
from teasim.pool.clips.order import ascending, digest_sample, gather
from teasim.pool.lerobot.log import Rows
from teasim.pool.source import Clip


def image_clip(rows: Rows, column: str) -> Clip:
    """Return the pictures in a column of a demonstration's rows."""
    first = int(rows.places[0])
    if np.array_equal(rows.places, np.arange(first, first + len(rows))):
        return ImageClip(rows.path, column, first, len(rows))
    return ScatteredImages(rows.path, column, tuple(rows.places.tolist()))


@dataclass(frozen=True)
class ScatteredImages:
    """The frames of one demonstration as encoded pictures in any rows of a data file."""

    path: Path
    """The data file."""
    column: str
    """Column of the pictures."""
    rows: tuple[int, ...]
    """Row of each frame."""

    @property
    def length(self) -> int:
        """Number of frames."""
        return len(self.rows)

    def frames(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the frames `indices`; see `teasim.pool.source.Clip`."""
        return gather(self, indices)

    def stream(self, indices: Sequence[int] | np.ndarray) -> Iterator[np.ndarray]:
        """Yield the frames `indices`, which ascend; see `teasim.pool.source.Clip`."""
        for row in np.array(self.rows)[ascending(self, indices)].tolist():
            yield next(ImageClip(self.path, self.column, row, 1).stream([0]))

    def digest(self) -> str:
        """Return the hash that the same pictures have in rows that follow each other.

        Raises:
            PoolError: The file is missing or damaged.
        """
        content = hashlib.sha256(f"images {self.length}\n".encode())
        for row in np.array(self.rows)[digest_sample(self.length)]:
            for stored in ImageClip(self.path, self.column, int(row), 1).stored(np.array([0])):
                content.update(hashlib.sha256(stored).digest())
        return content.hexdigest()

    def mp4(self) -> None:
        """Return nothing: no mp4 is stored."""
