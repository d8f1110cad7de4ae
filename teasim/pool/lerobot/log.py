"""The log of a data file: which of its rows belong to which demonstration, and when they were.

Rows are found by their `episode_index` and put in order by their `index`, never by position: tables
are shuffled, merged and split by many tools.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyarrow as pa

from teasim.common.errors import PoolError
from teasim.pool.lerobot.columns import numbers, read_table, whole_numbers

TIME_TOLERANCE = 1e-3
"""Largest deviation of a timestamp from the grid of the frame rate that is rounding [s]."""
NUMBERED = ("episode_index", "index", "frame_index", "timestamp")
"""Columns that number the rows; only the first must be there."""


@dataclass(frozen=True)
class Rows:
    """The rows of one demonstration in its data file, in order of time."""

    path: Path
    """The data file."""
    places: np.ndarray
    """Row numbers in the file, (n,)."""
    numbered: dict[str, np.ndarray]
    """Columns of `NUMBERED` that are there, (n,) each."""

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.places)

    def select(self, column: pa.ChunkedArray) -> pa.ChunkedArray:
        """Return the demonstration's part of a column of the file."""
        first = int(self.places[0]) if len(self.places) else 0
        if np.array_equal(self.places, np.arange(first, first + len(self.places))):
            return column.slice(first, len(self.places))
        return column.take(pa.array(self.places))

    def times(self, fps: float) -> tuple[float, ...] | None:
        """Return when each frame was, counted from the first [s]; None on the grid of `fps`.

        Raises:
            PoolError: The timestamps do not ascend.
        """
        stamps = self.numbered.get("timestamp")
        if stamps is None or not len(stamps):
            return None
        since = stamps.astype(np.float64) - float(stamps[0])
        if not (np.diff(since) > 0).all() or not np.isfinite(since).all():
            raise PoolError(
                f"The timestamps of demonstration {self.numbered['episode_index'][0]} do not "
                f"ascend in the log '{self.path}'."
            )
        late = np.abs(since - np.arange(len(since)) / fps)
        return None if (late <= TIME_TOLERANCE).all() else tuple(since.tolist())


def rows_of(path: Path, episode: int) -> Rows:
    """Return the rows of demonstration `episode` in the data file `path`, perhaps none.

    Raises:
        PoolError: The file is missing or damaged.
    """
    try:
        status = path.stat()
    except OSError as error:
        raise PoolError(f"The file '{path}' is missing.") from error
    order, columns, indexes, edges = _ordered(path, status.st_mtime_ns, status.st_size)
    place = int(np.searchsorted(indexes, episode))
    found = place < len(indexes) and indexes[place] == episode
    part = slice(edges[place], edges[place + 1]) if found else slice(0, 0)
    return Rows(path, order[part], {name: values[part] for name, values in columns.items()})


_Ordered = tuple[np.ndarray, dict[str, np.ndarray], np.ndarray, np.ndarray]


@lru_cache(maxsize=16)
def _ordered(path: Path, mtime_ns: int, size: int) -> _Ordered:
    """Row numbers in order, numbering columns, demonstrations, and where each begins."""
    del mtime_ns, size  # they only tell the cache that the file has changed
    table = read_table(path, wanted=NUMBERED.__contains__)
    try:
        columns = {
            name: (numbers if name == "timestamp" else whole_numbers)(table[name], name)
            for name in table.column_names
        }
    except PoolError as error:
        raise PoolError(f"The log '{path}' is damaged: {_lowered(error)}") from error
    if "episode_index" not in columns:
        raise PoolError(f"The log '{path}' has no column 'episode_index'.")
    within = columns.get("index", columns.get("frame_index", np.arange(len(table))))
    order = np.lexsort((within, columns["episode_index"]))
    columns = {name: values[order] for name, values in columns.items()}
    indexes, firsts = np.unique(columns["episode_index"], return_index=True)
    return order, columns, indexes, np.append(firsts, len(order))


def _lowered(error: PoolError) -> str:
    text = str(error)
    return text[0].lower() + text[1:]
