"""Tables beside a folder of videos: who the demonstrations are, and their sub-tasks."""

import csv
import io
from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TypeVar

from teasim.common.errors import PoolError
from teasim.common.files import write_text
from teasim.pool.types import Span

DEMONSTRATIONS, LABELS = "demonstrations.csv", "labels.csv"


@dataclass(frozen=True)
class DemoRow:
    """One demonstration."""

    demonstration: str
    """Name of its videos without the ending."""
    demo_id: str
    """Its identity in the source it was converted from."""
    task: str
    """The task as a sentence."""


@dataclass(frozen=True)
class LabelRow:
    """One sub-task of one demonstration."""

    demonstration: str
    """Name of its videos without the ending."""
    subtask: str
    """Name of the sub-task."""
    start: int
    """First frame."""
    stop: int
    """Frame after the last one."""


Row = TypeVar("Row", DemoRow, LabelRow)


def write_tables(root: Path, demos: Sequence[DemoRow], labels: Sequence[LabelRow]) -> None:
    """Write both tables into the folder `root`.

    Raises:
        OSError: they cannot be written.
    """
    _write(root / DEMONSTRATIONS, DemoRow, demos)
    if labels:
        _write(root / LABELS, LabelRow, labels)


def read_demonstrations(root: Path) -> dict[str, DemoRow]:
    """Return the demonstrations by name; none where there is no such table.

    Raises:
        PoolError: the table is damaged.
    """
    return {cells[0]: DemoRow(*cells) for cells in _read(root / DEMONSTRATIONS, DemoRow)}


def read_labels(root: Path) -> dict[str, tuple[Span, ...]]:
    """Return the sub-tasks by demonstration; none where there is no such table.

    Raises:
        PoolError: the table is damaged.
    """
    labels: dict[str, tuple[Span, ...]] = {}
    for name, subtask, start, stop in _read(root / LABELS, LabelRow):
        try:
            span = Span(subtask, int(start), int(stop))
        except ValueError as error:
            raise PoolError(f"'{root / LABELS}' holds text in place of a number.") from error
        labels[name] = (*labels.get(name, ()), span)
    return labels


def is_table(path: Path) -> bool:
    """Tell whether a file is one of the tables that are read or written beside videos."""
    return path.name in (DEMONSTRATIONS, LABELS, "weights.csv")


def _write(path: Path, kind: type[Row], rows: Sequence[Row]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(field.name for field in fields(kind))
    writer.writerows(astuple(row) for row in rows)
    write_text(path, text.getvalue())


def _read(path: Path, kind: type[Row]) -> list[list[str]]:
    """Return the rows of a table whose head is that of `kind`; none of another file."""
    columns = [field.name for field in fields(kind)]
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            lines = list(csv.reader(stream))
    except FileNotFoundError:
        return []
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PoolError(f"The table '{path}' is not readable as CSV.") from error
    if not lines or lines.pop(0) != columns:
        return []  # a file of somebody else that happens to have this name
    if any(len(cells) != len(columns) for cells in lines):
        raise PoolError(f"A line of '{path}' does not have the columns {', '.join(columns)}.")
    return lines
