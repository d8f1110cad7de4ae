"""The verb `inspect`: what a pool holds, and whether it is sound."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

if TYPE_CHECKING:
    from teasim.pool import Episode, Pool

UNKNOWN = "-"


@dataclass(frozen=True)
class InspectConfig:
    """Show the demonstrations of a pool and check every file of it."""

    pool: Annotated[Path, tyro.conf.Positional]
    """Folder of a pool: any LeRobot v3.0 data set."""
    leakage: bool = False
    """Also tell what gives the incorrect demonstrations away: 0.5 is nothing, 0 and 1 are all."""


def main(argv: Sequence[str] | None = None) -> int:
    """Show the demonstrations of a pool, its hash, and any damage.

    Returns:
        0 when the pool is sound, 1 when it is damaged.

    Raises:
        PoolError: There is no pool at the path, or leakage is asked for without labels.
    """
    config = tyro.cli(InspectConfig, prog="teasim inspect", args=argv)
    from teasim.common.errors import PoolError
    from teasim.pool import Pool
    from teasim.pool.integrity import check_pool

    problems = check_pool(config.pool)
    try:
        print(_description(Pool.open(config.pool)))
    except PoolError as error:
        problems = list(dict.fromkeys([*problems, str(error)]))
    for problem in problems:
        print(problem)
    print(f"Integrity: {_verdict(len(problems))}")
    if config.leakage and not problems:
        print(_leakage(Pool.open(config.pool)))
    return 1 if problems else 0


def _leakage(pool: Pool) -> str:
    """The clues in words."""
    from teasim.pool.leakage import leakage

    lines = [
        "Leakage (AUROC of one clue alone, incorrect against correct; 0.5 gives nothing away):"
    ]
    return "\n".join(
        [*lines, *(f"  {name:20}{value:.2f}" for name, value in leakage(pool).items())]
    )


def _description(pool: Pool) -> str:
    """The pool in words: a table of demonstrations, then what they have in common."""
    header = ["#", "demo_id", "s", "sequence", "correct", "mistakes", "participant", "sub-tasks"]
    table = _aligned([header, *(_row(pool, episode) for episode in pool.episodes)])
    seconds = sum(episode.length for episode in pool.episodes) / pool.fps
    facts = {
        "Pool": str(pool.root),
        "Demonstrations": f"{len(pool.episodes)}, {seconds:.1f} s in all",
        "Cameras": ", ".join(pool.cameras) or "none",
        "Frames per second": f"{pool.fps:g}",
        "Joint log": f"{len(pool.state_names)} dimensions" if pool.state_names else "none",
        "Sub-tasks": ", ".join(pool.subtasks) or "none labelled",
        "Content hash": _or_unknown(pool.content_hash),
    }
    width = max(map(len, facts)) + 1
    lines = [f"{name + ':':{width}} {value}" for name, value in facts.items()]
    return "\n".join([*table, "", *lines])


def _row(pool: Pool, episode: Episode) -> list[str]:
    from teasim.common.errors import PoolError

    start = [str(episode.index), _or_unknown(lambda: episode.demo_id)]
    seconds = f"{episode.length / pool.fps:.1f}"
    try:
        known = episode.record
        spans = " ".join(span.subtask for span in episode.spans()) or UNKNOWN
        participant = episode.participant or UNKNOWN
    except PoolError:
        return [*start, seconds, *[UNKNOWN] * 5]
    if known is None:
        return [*start, seconds, *[UNKNOWN] * 3, participant, spans]
    mistakes = ", ".join(f"{m.name} {m.subtask}" for m in known.mistakes) or "none"
    correct = "yes" if known.correct else "no"
    return [*start, seconds, known.sequence, correct, mistakes, participant, spans]


def _verdict(n_problems: int) -> str:
    if not n_problems:
        return "sound"
    return "damaged, 1 problem" if n_problems == 1 else f"damaged, {n_problems} problems"


def _or_unknown(read: Callable[[], str]) -> str:
    """What `read` returns; unknown where damage, which is listed below, keeps it from us."""
    from teasim.common.errors import PoolError

    try:
        return read()
    except PoolError:
        return UNKNOWN


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows of a table with columns of one width; the last column is not padded."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]
