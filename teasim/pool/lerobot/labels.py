"""Sub-task labels in the forms in which data sets carry them.

In this order: spans beside a demonstration (SARM's columns sparse_subtask_* and dense_subtask_*),
sentences of `language_persistent` (LeRobot 0.6), and a number per frame (`subtask_index`).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from teasim.common.errors import PoolError
from teasim.pool.lerobot.log import Rows
from teasim.pool.types import Span

KINDS = ("sparse", "dense")
"""SARM's two levels of detail."""
STYLE = "subtask"
"""Style of the sentences of `language_persistent` with which a sub-task begins."""
ROUNDING = 1
"""A span may end this many frames after the demonstration; times were rounded to frames."""


def annotated_kind(table: pa.Table) -> str | None:
    """Return which of `KINDS` the episodes table names sub-tasks by; None when it has none.

    Annotators who fill in the dense level alone write one sparse sub-task as long as the
    demonstration; the level with more than one name counts then.
    """
    named = {kind: annotated_names(table, kind) for kind in KINDS}
    for least in (2, 1):
        for kind, names in named.items():
            if len(names) >= least:
                return kind
    return None


def annotated_names(table: pa.Table, kind: str) -> tuple[str, ...]:
    """Return the sub-tasks the episodes table names, in the order of first mention."""
    column = f"{kind}_subtask_names"
    if column not in table.column_names or not pa.types.is_list(table.schema.field(column).type):
        return ()
    names = pc.unique(pc.list_flatten(table[column])).to_pylist()
    return tuple(dict.fromkeys(str(name) for name in names if name is not None))


def annotated_spans(row: Mapping[str, Any], kind: str, length: int) -> tuple[Span, ...]:
    """Return the spans of `kind` beside a demonstration of `length` frames.

    Raises:
        PoolError: They are not readable, or leave the demonstration.
    """
    parts = [
        row.get(f"{kind}_subtask_{part}") or () for part in ("names", "start_frames", "end_frames")
    ]
    where = f"The sub-task spans of demonstration {row['episode_index']}"
    try:
        told = [(str(name), int(a), int(b)) for name, a, b in zip(*parts, strict=True)]
    except (TypeError, ValueError, OverflowError) as error:
        raise PoolError(f"{where} are not readable.") from error
    if any(stop > length + ROUNDING for _, _, stop in told):
        raise PoolError(f"{where} end after its {length} frames.")
    return tuple(Span(name, a, min(b, length)) for name, a, b in told if a < min(b, length))


def said(column: pa.ChunkedArray) -> list[tuple[float, str]]:
    """Return (time [s], sentence) of each sub-task that a demonstration's rows name.

    The same list stands in every row, so the first is read.

    Raises:
        PoolError: The list is not readable.
    """
    try:
        rows = column[0].as_py() or () if len(column) else ()
        told = [row for row in rows if row.get("style") == STYLE and row.get("content")]
        return sorted((float(row["timestamp"]), str(row["content"])) for row in told)
    except (AttributeError, KeyError, TypeError, ValueError, OverflowError) as error:
        raise PoolError("The column 'language_persistent' is not readable.") from error


def said_spans(told: Sequence[tuple[float, str]], rows: Rows, fps: float) -> tuple[Span, ...]:
    """Return the spans of sentences; each lasts until the next begins, the last to the end."""
    stamps = rows.numbered.get("timestamp")
    grid = np.arange(len(rows)) / fps if stamps is None else stamps.astype(np.float64)
    begins = [time - 0.5 / fps for time, _ in told]
    edges = [*np.searchsorted(grid, begins).tolist(), len(rows)]
    return tuple(
        Span(name, first, stop)
        for (_, name), first, stop in zip(told, edges, edges[1:], strict=False)
        if first < stop
    )
