"""The weight table, the contract between a filter and a learner: one row per demonstration."""

import csv
import io
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

from teasim.common.errors import PoolError
from teasim.common.files import write_text
from teasim.pool.lerobot.identity import matched


@dataclass(frozen=True)
class WeightRow:
    """What a filter says about one demonstration."""

    demo_id: str
    """Content-derived identity of the demonstration."""
    episode_index: int
    """Its number in the pool that was filtered."""
    weight: float
    """How much a learner should use it, in [0, 1]."""
    loss: float
    """Its surprise under the model of the others [nats]; higher is worse."""
    flagged: bool
    """Whether it is called incorrect."""
    group: int
    """Its cluster; 0 is the best."""
    reason: str
    """One sentence naming the step and time span; empty for a usual demonstration."""
    p_incorrect: float | None = None
    """Probability that it is incorrect, in [0, 1]; None in tables that do not have it."""
    task: str = ""
    """The task it was judged with; empty where the pool does not name one."""

    def __post_init__(self) -> None:
        """Refuse values out of range."""
        what = f"Demonstration {self.episode_index} of the weight table"
        if not self.demo_id:
            raise PoolError(f"{what} has no demo_id.")
        if self.episode_index < 0:
            raise PoolError(f"{what} has a negative number.")
        if not 0.0 <= self.weight <= 1.0:
            raise PoolError(f"{what} has the weight {self.weight}; it must lie in [0, 1].")
        if self.p_incorrect is not None and not 0.0 <= self.p_incorrect <= 1.0:
            raise PoolError(
                f"{what} has the probability {self.p_incorrect}; it must lie in [0, 1]."
            )
        if not math.isfinite(self.loss):
            raise PoolError(f"{what} has the loss {self.loss}; it must be finite.")
        if any(character in self.demo_id + self.reason + self.task for character in "\r\n\0"):
            raise PoolError(f"{what} has a reason or a task of more than one line.")
        if self.group < 0:
            raise PoolError(f"{what} has the group {self.group}; groups count from 0.")


COLUMNS = tuple(field.name for field in fields(WeightRow))
EARLIER_COLUMNS = (COLUMNS[:-2], COLUMNS[:-1])
"""Columns of tables without p_incorrect or task, which are still read."""


def write_weight_table(path: Path | str, rows: Iterable[WeightRow]) -> None:
    """Write `rows` as CSV, in the order of `episode_index`, atomically.

    Raises:
        PoolError: A demonstration has two rows.
    """
    ordered = sorted(rows, key=lambda row: row.episode_index)
    _check_unique(Path(path), ordered)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for row in ordered:
        numbers = [int(row.episode_index), float(row.weight), float(row.loss)]
        p = "" if row.p_incorrect is None else float(row.p_incorrect)
        rest = [int(row.flagged), int(row.group), row.reason, p, row.task]
        writer.writerow([row.demo_id, *numbers, *rest])
    write_text(Path(path), text.getvalue())


def read_weight_table(path: Path | str) -> tuple[WeightRow, ...]:
    """Read a weight table back, in the order of `episode_index`.

    Raises:
        PoolError: The file is missing, is no weight table, or a value is out of range.
    """
    path = Path(path)
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            lines = list(csv.reader(stream))
    except FileNotFoundError as error:
        raise PoolError(f"There is no weight table at '{path}'.") from error
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise PoolError(f"The weight table '{path}' is not readable as CSV.") from error
    if not lines or tuple(lines[0]) not in (COLUMNS, *EARLIER_COLUMNS):
        raise PoolError(f"'{path}' is no weight table; its columns must be {', '.join(COLUMNS)}.")
    count = len(lines[0])
    rows = [_parse(path, number, cells, count) for number, cells in enumerate(lines[1:], start=2)]
    _check_unique(path, rows)
    return tuple(sorted(rows, key=lambda row: row.episode_index))


def match_rows(rows: Sequence[WeightRow], identities: Sequence[str]) -> list[WeightRow | None]:
    """Return the row of each demonstration, None for one that the table does not know.

    A row fits by its `demo_id` or a half of it; see `teasim.pool.lerobot.identity.matched`.

    Args:
        rows: The weight table.
        identities: `demo_id` of each demonstration.
    """
    own = {row.demo_id: row for row in rows}
    told = matched(list(own), identities)
    return [None if identity is None else own[identity] for identity in told]


def _parse(path: Path, line: int, cells: Sequence[str], count: int) -> WeightRow:
    if len(cells) != count:
        raise PoolError(
            f"Line {line} of '{path}' has {len(cells)} values; a weight table has {count}."
        )
    demo_id, index, weight, loss, flagged, group, reason, *more = cells
    if flagged not in ("0", "1"):
        raise PoolError(f"Line {line} of '{path}' says flagged is '{flagged}'; choose 0 or 1.")
    try:
        p = float(more[0]) if more and more[0] else None
        whole = (demo_id, int(index), float(weight), float(loss), flagged == "1", int(group))
        return WeightRow(*whole, reason, p, *more[1:])
    except ValueError as error:
        raise PoolError(f"Line {line} of '{path}' holds text in place of a number.") from error


def _check_unique(path: Path, rows: Sequence[WeightRow]) -> None:
    seen: set[int] = set()
    for row in rows:
        if row.episode_index in seen:
            raise PoolError(
                f"The weight table '{path}' has demonstration {row.episode_index} twice."
            )
        seen.add(row.episode_index)
