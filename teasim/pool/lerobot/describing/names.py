"""Lists of names with their numbers: meta/tasks.parquet and meta/subtasks.parquet."""

from collections.abc import Mapping
from pathlib import Path

from teasim.common.errors import PoolError
from teasim.pool.lerobot.columns import read_table

MOST_NAMES = 100_000
"""A list of names with a higher number is taken to be damaged."""


def names_by_number(path: Path, number: str) -> Mapping[int, str]:
    """Return the names of a list by their number, which stands in the column `number`.

    Negative numbers stand for no name and are left out. A missing file is an empty list.

    Raises:
        PoolError: The file is damaged.
    """
    if not path.exists():
        return {}
    named = {}
    for row in _rows(path):
        index = row.pop(number, None)
        name = next((value for value in row.values() if isinstance(value, str)), None)
        if not isinstance(index, int) or not index < MOST_NAMES or name is None:
            raise PoolError(f"The file '{path}' is damaged: it has no names with their numbers.")
        if index >= 0:
            named[index] = name
    return named


def in_order(named: Mapping[int, str], what: str, count: int = 0) -> tuple[str, ...]:
    """Return the names in the order of their numbers; a number without one is '`what` NUMBER'."""
    last = max([*named, count - 1], default=-1)
    return tuple(named.get(number, f"{what} {number}") for number in range(last + 1))


def _rows(path: Path) -> list[dict[str, object]]:
    table = read_table(path)
    try:
        rows: list[dict[str, object]] = table.to_pylist()
    except (ValueError, OverflowError) as error:
        raise PoolError(f"The file '{path}' is damaged: its values are not readable.") from error
    return rows
