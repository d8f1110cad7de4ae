"""The pool that a policy learns from, with the sub-tasks that a filter found where none are logged.

The decisions of its policies are named as those sub-tasks are: step 1 to step q, or by the names
that were told for them.
"""

from pathlib import Path
from typing import cast

from teasim.common.errors import ConfigError
from teasim.pool import Pool
from teasim.pool.segments_table import read_segments_table
from teasim.pool.views.segmented import Segmented
from teasim.pool.writers.subtask_names import check_names, read_names

SEGMENTS, WEIGHTS = "segments.csv", "weights.csv"
"""Files of a filter's output."""


def weight_table(weights: Path | None) -> Path | None:
    """Return the table of weights, given it or the output folder of a filter that holds it."""
    return weights / WEIGHTS if weights is not None and weights.is_dir() else weights


def with_found_subtasks(
    pool: Pool, segments: Path | None, weights: Path | None, names: Path | None
) -> Pool:
    """Return a pool with the sub-tasks of a table; without a table, the pool as it is.

    Args:
        pool: the demonstrations.
        segments: the table; None takes the one in `weights` if the pool logs no sub-tasks.
        weights: table of weights, or the output folder of a filter.
        names: file with names for the sub-tasks; None keeps those of the table.

    Raises:
        ConfigError: names are given without a table, or for a sub-task that it does not hold.
        PoolError: the table is missing, damaged or of another pool, or holds no segment.
    """
    beside = weights / SEGMENTS if weights is not None and weights.is_dir() else None
    if segments is None and not pool.subtasks and beside is not None and beside.exists():
        segments = beside
    if segments is None:
        if names is not None:
            raise ConfigError("Names are for found sub-tasks; give their table with --segments.")
        return pool
    rows = read_segments_table(segments)
    if not rows:
        raise ConfigError(
            f"'{segments}' holds no sub-task; find some with: teasim filter {pool.root} "
            "-o FINDINGS --segmenter clustering"
        )
    told = None if names is None else read_names(names)
    check_names(told or {}, tuple(dict.fromkeys(row.subtask for row in rows)))
    return cast("Pool", Segmented(pool, rows, told))
