"""The table of segments that a filter found, segments.csv: one row per segment."""

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from pathlib import Path

from teasim.common.errors import PoolError
from teasim.common.files import write_text
from teasim.pool.lerobot.identity import matched
from teasim.pool.source import Demonstration, Source
from teasim.pool.types import Span


@dataclass(frozen=True)
class SegmentRow:
    """One segment of one demonstration."""

    demo_id: str
    """Identity of the demonstration."""
    episode_index: int
    """Its number in the source that was filtered."""
    subtask: str
    """Name of the sub-task, or what a segmenter called it."""
    start: int
    """First frame."""
    stop: int
    """Frame after the last one."""

    def __post_init__(self) -> None:
        """Refuse a segment without a frame, a demonstration or a name."""
        if not self.demo_id or not self.subtask or not 0 <= self.start < self.stop:
            raise PoolError(
                f"A segment of demonstration {self.episode_index} is '{self.subtask}', frames "
                f"{self.start} to {self.stop}; that is no segment."
            )

    @property
    def span(self) -> Span:
        """The segment without its demonstration."""
        return Span(self.subtask, self.start, self.stop)


COLUMNS = tuple(field.name for field in fields(SegmentRow))


def segment_rows(source: Source, spans: Sequence[Sequence[Span]]) -> list[SegmentRow]:
    """Return the rows of all segments, given those of each demonstration of a source."""
    return [
        SegmentRow(demo.demo_id, demo.index, span.subtask, span.start, span.stop)
        for demo, own in zip(source.episodes, spans, strict=True)
        for span in own
    ]


def write_segments_table(path: Path | str, rows: Iterable[SegmentRow]) -> None:
    """Write `rows` as CSV in their order, atomically.

    Raises:
        OSError: the file cannot be written.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows([getattr(row, name) for name in COLUMNS] for row in rows)
    write_text(Path(path), text.getvalue())


def read_segments_table(path: Path | str) -> tuple[SegmentRow, ...]:
    """Read a table of segments.

    Raises:
        PoolError: the file is missing, is no such table, or segments overlap.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            lines = list(csv.reader(stream))
    except FileNotFoundError as error:
        raise PoolError(f"There is no table of segments at '{path}'.") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PoolError(f"The table of segments '{path}' is not readable as CSV.") from error
    if not lines or tuple(lines[0]) != COLUMNS:
        columns = ", ".join(COLUMNS)
        raise PoolError(f"'{path}' is no table of segments; its columns must be {columns}.")
    rows = tuple(_parse(path, line, cells) for line, cells in enumerate(lines[1:], start=2))
    for before, after in pairwise(rows):
        if before.demo_id == after.demo_id and after.start < before.stop:
            raise PoolError(
                f"Segments of demonstration {after.episode_index} in '{path}' overlap at frame "
                f"{after.start}."
            )
    return rows


def spans_by_demonstration(
    rows: Sequence[SegmentRow], demos: Sequence[Demonstration]
) -> list[tuple[Span, ...] | None]:
    """Return the segments of each demonstration; None for one that the table does not know.

    Raises:
        PoolError: a segment ends after its demonstration.
    """
    own: dict[str, list[Span]] = {}
    for row in rows:
        own.setdefault(row.demo_id, []).append(row.span)
    found: list[tuple[Span, ...] | None] = []
    told = matched(list(own), [demo.demo_id for demo in demos])
    for demo, identity in zip(demos, told, strict=True):
        spans = None if identity is None else tuple(own[identity])
        if spans and spans[-1].stop > demo.length:
            raise PoolError(
                f"The table of segments ends at frame {spans[-1].stop} of '{demo.name}', which "
                f"has {demo.length} frames."
            )
        found.append(spans)
    return found


def _parse(path: Path, line: int, cells: Sequence[str]) -> SegmentRow:
    if len(cells) != len(COLUMNS):
        raise PoolError(
            f"Line {line} of '{path}' has {len(cells)} values; a table of segments has "
            f"{len(COLUMNS)}."
        )
    demo_id, index, subtask, start, stop = cells
    try:
        return SegmentRow(demo_id, int(index), subtask, int(start), int(stop))
    except ValueError as error:
        raise PoolError(f"Line {line} of '{path}' holds text in place of a number.") from error
