"""The demonstrations of a data set as the metadata list them, read by columns.

v3.0 keeps them in parquet files, v2.0 and v2.1 in JSON lines. Both become one `EpisodeTable`.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa

from teasim.common.errors import PoolError
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import numbers, read_table, whole_numbers
from teasim.pool.lerobot.describing.documents import read_lines

Row = Mapping[str, Any]
"""A demonstration's row of the episodes table, without its statistics."""

WHOLE = ("episode_index", "length", "dataset_from_index", "dataset_to_index")
"""Whole numbers of each demonstration, in every version."""
PLACE = ("data/chunk_index", "data/file_index")
"""Whole numbers that tell its data file, since v3.0."""
OWN = re.compile(r"teasim/|(?:sparse|dense)_subtask_")
"""Entries of the JSON lines that other versions keep in columns of these names."""
LARGEST = 2**40
"""No number, file or frame of a data set is counted higher."""
LONGEST = 10**8
"""Most frames of a demonstration: 900 hours at 30 frames per second."""
LATEST = 1e9
"""No demonstration begins later in its video [s]."""


@dataclass(frozen=True)
class EpisodeTable:
    """All demonstrations in the order of their numbers."""

    numbers: Mapping[str, np.ndarray]
    """Checked columns of numbers, (n,) each."""
    others: pa.Table
    """The other columns as they are, of n rows."""

    def __len__(self) -> int:
        """Number of demonstrations."""
        return len(self.numbers["episode_index"])

    def row(self, place: int) -> dict[str, Any]:
        """Return the row of the demonstration at `place`.

        Raises:
            PoolError: A value has no counterpart in Python, e.g. a date far out of range.
        """
        row: dict[str, Any] = {name: c[place].item() for name, c in self.numbers.items()}
        try:
            return row | {
                name: self.others[name][place].as_py() for name in self.others.schema.names
            }
        except (ValueError, OverflowError, pa.ArrowException) as error:
            raise PoolError(
                f"The episodes table is damaged: row {place} is not readable."
            ) from error

    def only(self, place: int) -> Self:
        """Return a table of the demonstration at `place` alone."""
        part = {name: column[place : place + 1] for name, column in self.numbers.items()}
        return type(self)(part, self.others.take([place]))


def read_parquet_episodes(root: Path, video_keys: Sequence[str]) -> EpisodeTable:
    """Return the demonstrations of a data set of version 3.

    Raises:
        PoolError: There are none, or a file or value is damaged.
    """
    files = sorted((root / layout.EPISODES_FOLDER).rglob("*.parquet"))
    if not files:
        raise PoolError(f"The pool '{root}' is empty: it has no demonstration.")
    whole = [*WHOLE, *PLACE, *_places(video_keys)]
    times = [f"videos/{key}/from_timestamp" for key in video_keys]
    parts = [_checked_part(root, file, whole, times) for file in files]
    try:
        others = pa.concat_tables([part.others for part in parts], promote_options="permissive")
    except pa.ArrowException as error:
        raise PoolError(
            f"The episodes table of '{root}' is damaged: its files have other columns each."
        ) from error
    columns = {
        name: np.concatenate([part.numbers[name] for part in parts]) for name in parts[0].numbers
    }
    return _sorted(root, columns, others.combine_chunks())


def read_json_episodes(root: Path) -> EpisodeTable:
    """Return the demonstrations of a data set of version 2; each has files of its own.

    Raises:
        PoolError: There are none, or a line is damaged.
    """
    path = root / layout.EPISODES_LINES
    lines = read_lines(path)
    if not lines:
        raise PoolError(f"The pool '{root}' is empty: it has no demonstration.")
    columns = {name: _line_numbers(path, lines, name) for name in ("episode_index", "length")}
    names = [line.get("tasks") for line in lines]
    tasks = [told if isinstance(told, list) else [told] for told in names]
    texts = [[str(task) for task in told if task is not None] for told in tasks]
    table = pa.table({"tasks": pa.array(texts, pa.list_(pa.string())), **_own(path, lines)})
    order = np.argsort(columns["episode_index"], kind="stable")
    stops = np.empty(len(lines), dtype=np.int64)
    stops[order] = np.cumsum(columns["length"][order])
    columns["dataset_from_index"] = stops - columns["length"]
    columns["dataset_to_index"] = stops
    for name in WHOLE:
        _check_whole(root, name, columns[name])
    return _sorted(root, columns, table)


def _own(path: Path, lines: Sequence[Mapping[str, Any]]) -> dict[str, pa.Array]:
    """Return what other versions keep in columns: spans of sub-tasks, and teasim's facts."""
    names = {name: None for line in lines for name in line if OWN.match(name)}
    try:
        return {name: pa.array([line.get(name) for line in lines]) for name in names}
    except (pa.ArrowException, OverflowError, ValueError, TypeError) as error:
        raise PoolError(f"The file '{path}' is damaged: a list of it is not readable.") from error


def _places(video_keys: Sequence[str]) -> list[str]:
    return [f"videos/{key}/{part}_index" for key in video_keys for part in ("chunk", "file")]


def _checked_part(
    root: Path, file: Path, whole: Sequence[str], times: Sequence[str]
) -> EpisodeTable:
    table = read_table(file, wanted=lambda name: not name.startswith("stats/"))
    columns = {}
    ends = [name.replace("/from_", "/to_") for name in times]
    times = [*times, *(name for name in ends if name in table.column_names)]
    for name in [*whole, *times]:
        if name not in table.column_names:
            raise PoolError(f"The episodes table of '{root}' is damaged: '{name}' is missing.")
        try:
            read = numbers if name in times else whole_numbers
            columns[name] = read(table[name], name)
        except PoolError as error:
            raise PoolError(
                f"The episodes table of '{root}' is damaged: {_lowered(error)}"
            ) from error
        if name in times:
            columns[name] = columns[name].astype(np.float64)
            _check_range(root, name, columns[name], (0, LATEST))
        else:
            _check_whole(root, name, columns[name])
    kept = [name for name in table.column_names if name not in columns]
    if len(set(kept)) < len(kept):
        raise PoolError(f"The episodes table of '{root}' is damaged: a column stands in it twice.")
    return EpisodeTable(columns, table.select(kept))


def _check_whole(root: Path, name: str, values: np.ndarray) -> None:
    if name == "length" and (values < 1).any():
        raise PoolError(f"A demonstration of '{root}' has no frame: 'length' is {values.min()}.")
    _check_range(root, name, values, (0, LONGEST if name == "length" else LARGEST))


def _check_range(root: Path, name: str, values: np.ndarray, bounds: tuple[float, float]) -> None:
    wrong = ~((values >= bounds[0]) & (values < bounds[1]))
    if wrong.any():
        raise PoolError(
            f"The episodes table of '{root}' is damaged: '{name}' is {values[wrong][0]}."
        )


def _sorted(root: Path, columns: Mapping[str, np.ndarray], others: pa.Table) -> EpisodeTable:
    """In the order of the number, which must be each demonstration's own."""
    index = columns.get("episode_index", np.empty(0))
    if not len(index):
        raise PoolError(f"The pool '{root}' is empty: it has no demonstration.")
    order = np.argsort(index, kind="stable")
    twice = index[order][1:][np.diff(index[order]) == 0]
    if twice.size:
        raise PoolError(
            f"The episodes table of '{root}' is damaged: it has demonstration {twice[0]} twice."
        )
    if (np.diff(order) != 1).any():
        others = others.take(pa.array(order))
    return EpisodeTable({name: values[order] for name, values in columns.items()}, others)


def _line_numbers(path: Path, lines: Sequence[Mapping[str, Any]], name: str) -> np.ndarray:
    values = [line.get(name) for line in lines]
    for number, value in enumerate(values, start=1):
        if not _is_whole(value):
            raise PoolError(f"The file '{path}' is damaged: '{name}' is {value} in line {number}.")
    return np.array(values, dtype=np.int64)


def _is_whole(value: Any) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and 0 <= value < LARGEST and value == int(value)


def _lowered(error: PoolError) -> str:
    text = str(error)
    return text[0].lower() + text[1:]
