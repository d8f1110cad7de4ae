"""The different sequences of steps of a source, as data and as text."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from teasim.cli.facts import WIDTH
from teasim.common.errors import ConfigError

if TYPE_CHECKING:
    from teasim.pool.source import Source
    from teasim.pool.ways.ways import Ways

TABLE = "segments.csv"
"""Name of the table of segments in a folder of findings."""


def ways_of(source: Source, segments: Path | None) -> Ways:
    """Return the ways of a source, from logged steps, stored predictions, or found segments.

    Args:
        source: the demonstrations.
        segments: table of segments, or the folder that a filter wrote; None for those stored in it.

    Raises:
        ConfigError: nothing is logged and no table is given, or the table knows no demonstration.
        PoolError: the table or the labels are damaged.
    """
    from teasim.pool.ways.ways import find_ways

    if segments is None:
        spans = [demo.spans() for demo in source.episodes]
        if not any(spans) and source.has_predictions:
            spans = [demo.predicted_spans() for demo in source.episodes]
        if not any(spans):
            raise ConfigError(
                f"'{source.root}' has no logged sub-tasks; run 'teasim filter {source.root} -o "
                f"findings' and add '--segments findings'."
            )
    else:
        spans = _found(source, segments)
    return find_ways([[span.subtask for span in own] for own in spans])


def _found(source: Source, segments: Path) -> list[Any]:
    from teasim.pool.segments_table import read_segments_table, spans_by_demonstration

    path = segments / TABLE if segments.is_dir() else segments
    found = spans_by_demonstration(read_segments_table(path), source.episodes)
    unknown = [demo.name for demo, own in zip(source.episodes, found, strict=True) if own is None]
    if unknown:
        raise ConfigError(
            f"The table of segments '{path}' does not know '{unknown[0]}'; run 'teasim filter "
            f"{source.root} -o findings' and add '--segments findings'."
        )
    return found


def words_of(ways: Ways) -> tuple[str, ...]:
    """Return sentences about the ways of a source of two or more demonstrations."""
    from teasim.pool.ways.words import words_about

    return words_about(ways) if len(ways.demos) > 1 else ()


def sequences_text(ways: Ways) -> str:
    """Describe the sequences: how many follow each, and how the rarer ones differ from the first.

    The first is told in full; of another one also its demonstrations.
    """
    usual, *others = ways.all
    lines = [
        f"Sequences:      {len(ways.all)} different in {len(ways.demos)} demonstrations",
        _wrapped(f"{len(usual.rows):4} x  ", ", ".join(usual.steps) or "no step"),
    ]
    for way in others:
        told = ", ".join(_difference(usual.steps, way.steps)) or "in other pieces"
        who = ", ".join(map(str, way.rows))
        lines.append(_wrapped(f"{len(way.rows):4} x  ", f"{told} (demonstrations {who})"))
    return "\n".join([*lines, *(textwrap.fill(words, WIDTH) for words in words_of(ways))])


def sequences_json(ways: Ways) -> dict[str, Any]:
    """Return the same as data: steps, demonstrations and sentences."""
    return {
        "sequences": [
            {"steps": list(way.steps), "demonstrations": list(way.rows)} for way in ways.all
        ],
        "words": list(words_of(ways)),
    }


def _difference(usual: Sequence[str], other: Sequence[str]) -> list[str]:
    from teasim.pool.ways.ways import difference

    return difference(usual, other)


def _wrapped(start: str, text: str) -> str:
    return textwrap.fill(text, WIDTH, initial_indent=start, subsequent_indent=" " * len(start))
