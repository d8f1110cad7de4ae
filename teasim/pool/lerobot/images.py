"""Pictures stored in the log itself, one PNG or JPEG file per row."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from teasim.common.errors import PoolError
from teasim.pool.clips.order import MAX_SIDE, ascending, gather, sample
from teasim.pool.lerobot.log import rows_of

BATCH = 16
"""Rows that are read at a time; a picture may be large."""
DIGEST_FRAMES = 8
"""Number of pictures, spread evenly, that `StoredImages.digest` hashes."""


@dataclass(frozen=True)
class StoredImages:
    """The pictures of one demonstration by one camera in a column of its data file."""

    path: Path
    """The data file."""
    column: str
    """Name of the column; its values have the parts `bytes` and perhaps `path`."""
    episode: int
    """Number of the demonstration."""
    length: int
    """Number of frames."""

    def frames(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the frames `indices`; see `teasim.pool.source.Clip`."""
        return gather(self, indices)

    def stream(self, indices: Sequence[int] | np.ndarray) -> Iterator[np.ndarray]:
        """Yield the frames `indices`, which ascend; see `teasim.pool.source.Clip`."""
        wanted = ascending(self, indices)
        shape = None
        places = self._places()[wanted]
        order = np.argsort(places, kind="stable")
        found: dict[int, np.ndarray] = {}
        following = 0
        for position, content in zip(order.tolist(), self._contents(places[order]), strict=True):
            image = self._decoded(content, int(wanted[position]))
            if shape not in (None, image.shape):
                raise self._damaged(int(wanted[position]))
            shape = image.shape
            found[position] = image
            while following in found:
                yield found.pop(following)
                following += 1

    def digest(self) -> str:
        """Return a hash of the pixels of `DIGEST_FRAMES` pictures.

        Raises:
            PoolError: The file is missing or damaged.
        """
        content = hashlib.sha256(f"images {self.length}\n".encode())
        for image in self.stream(sample(self.length, DIGEST_FRAMES)):
            content.update(f"{image.shape}\n".encode())
            content.update(image.tobytes())
        return content.hexdigest()

    def mp4(self) -> bytes | None:
        """Return None: no video is stored."""
        return None

    def _places(self) -> np.ndarray:
        places = rows_of(self.path, self.episode).places
        if len(places) != self.length:
            raise PoolError(
                f"The log '{self.path}' has {len(places)} rows of demonstration {self.episode}, "
                f"which has {self.length} frames."
            )
        return places

    def _contents(self, places: np.ndarray) -> Iterator[bytes | None]:
        """Yield the stored files in the rows `places`, which ascend and may repeat."""
        try:
            with pq.ParquetFile(self.path, page_checksum_verification=True) as file:
                edges = np.cumsum(
                    [0, *(file.metadata.row_group(g).num_rows for g in range(file.num_row_groups))]
                )
                for group in range(file.num_row_groups):
                    within = places[(places >= edges[group]) & (places < edges[group + 1])]
                    if within.size:
                        yield from self._group(file, group, within - edges[group])
        except (OSError, pa.ArrowException, ValueError, KeyError) as error:
            raise PoolError(
                f"The file '{self.path}' is damaged: the pictures of '{self.column}' are not "
                "readable."
            ) from error

    def _group(
        self, file: pq.ParquetFile, group: int, places: np.ndarray
    ) -> Iterator[bytes | None]:
        first = 0
        for batch in file.iter_batches(
            BATCH, row_groups=[group], columns=[self.column], use_threads=False
        ):
            values = batch.column(self.column)
            for place in places[(places >= first) & (places < first + len(batch))].tolist():
                stored = values[place - first].as_py()
                yield stored.get("bytes") if isinstance(stored, dict) else None
            first += len(batch)
            if first > places[-1]:
                return

    def _decoded(self, content: bytes | None, frame: int) -> np.ndarray:
        """The picture of a stored file, (H, W, 3) uint8 RGB."""
        import cv2

        if not isinstance(content, bytes) or not content:
            raise self._damaged(frame)
        try:
            image = cv2.imdecode(np.frombuffer(content, dtype=np.uint8), cv2.IMREAD_COLOR)
        except cv2.error as error:
            raise self._damaged(frame) from error
        if image is None or max(image.shape[:2]) > MAX_SIDE:
            raise self._damaged(frame)
        return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB))

    def _damaged(self, frame: int) -> PoolError:
        return PoolError(
            f"The picture '{self.column}' of frame {frame} of demonstration {self.episode} in "
            f"'{self.path}' is missing or damaged."
        )
