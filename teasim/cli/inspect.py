"""The verb `inspect`: what a source holds, and whether it is sound."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import tyro

from teasim.common.cli import parse

if TYPE_CHECKING:
    from teasim.pool.source import Source
    from teasim.pool.ways.ways import Ways

EXAMPLES = (
    "teasim inspect pool",
    "teasim inspect pool --leakage --json > pool.json",
    "teasim inspect films --sequences --segments findings",
)


@dataclass(frozen=True)
class InspectSettings:
    """Show the demonstrations of a pool and check every file of it."""

    source: tyro.conf.Positional[Path]
    """Folder or file with demonstrations, in any format that `teasim filter` reads."""
    leakage: tyro.conf.FlagCreatePairsOff[bool] = False
    """Also show how well single clues, such as the duration, tell incorrect from correct
    demonstrations (AUROC: 0.5 is chance). Needs a pool with labels of correctness."""
    sequences: tyro.conf.FlagCreatePairsOff[bool] = False
    """Also show the different sequences of steps: how many demonstrations follow each, what most
    do, and steps that may be optional. Reads logged sub-tasks, or --segments."""
    segments: Path | None = None
    """For --sequences: segments.csv of `teasim filter`, or the folder it is in."""
    fps: float | None = None
    """Frames per second [1/s] of a source that does not store them."""
    repair: Path | None = None
    """New folder for a sound copy of a LeRobot data set. Damaged demonstrations are set aside in
    it; the source is not changed."""
    json: tyro.conf.FlagCreatePairsOff[bool] = False
    """Print one JSON object instead of text."""


def main(argv: Sequence[str] | None = None) -> int:
    """Show the demonstrations of a pool, its hash, and any damage.

    Returns:
        0 when the source is sound, 1 when it is damaged.

    Raises:
        ConfigError: `--fps` is given for a source that stores its frame rate, or `--sequences` for
            one without steps.
        PoolError: nothing readable is at the path, or `--leakage` lacks labels.
    """
    settings = parse(InspectSettings, argv, verb="inspect", examples=EXAMPLES)
    if settings.repair is not None:
        return _repair(settings, settings.repair)
    from teasim.cli.facts import facts_of, json_of, problem_count, text_of
    from teasim.pool.readers.registry import reader_of

    reader = reader_of(settings.source)
    source, problems = _open_and_check(settings)
    clues = _leakage(source) if settings.leakage and source is not None and not problems else None
    ways = _ways(settings, None if problems else source)
    facts = None if source is None else facts_of(source)
    if settings.json:
        about = {"source": str(settings.source), "format": reader.name, "problems": problems}
        print(json.dumps(json_of(facts, **about, leakage=clues, **_shown(ways)), indent=2))
        return 1 if problems else 0
    if facts is not None:
        print(text_of(str(settings.source), reader.name, facts))
    print("\n".join([*problems, f"Integrity:      {problem_count(problems)}"]))
    if clues is not None:
        print(_leakage_text(clues))
    if ways is not None:
        from teasim.cli.sequences import sequences_text

        print(sequences_text(ways))
    return 1 if problems else 0


def _open_and_check(settings: InspectSettings) -> tuple[Source | None, list[str]]:
    """The source, None if it cannot be opened, and one sentence per problem."""
    from teasim.common.errors import PoolError
    from teasim.pool.readers.reader import ReadOptions
    from teasim.pool.readers.registry import check_source, open_source
    from teasim.pool.soundness import print_notes

    options = ReadOptions(fps=settings.fps)
    problems = check_source(settings.source, options)
    try:
        source = open_source(settings.source, options)
    except PoolError as error:
        return None, list(dict.fromkeys([*problems, str(error)]))
    print_notes(source)
    return source, problems


def _repair(settings: InspectSettings, target: Path) -> int:
    """Write a sound copy and say what was set aside.

    Raises:
        ConfigError: `target` is in use, or the format has no repair.
        PoolError: the source cannot be repaired.
    """
    from teasim.common.errors import ConfigError
    from teasim.pool.readers import lerobot
    from teasim.pool.readers.registry import reader_of
    from teasim.pool.repair import SET_ASIDE, repair_pool

    reader = reader_of(settings.source)
    if reader is not lerobot.READER:
        raise ConfigError(
            f"'{settings.source}' is of the format {reader.name}; --repair works on a "
            f"{lerobot.READER.name} only."
        )
    done = repair_pool(settings.source, target)
    for index, reasons in done.set_aside.items():
        print("\n".join(f"Demonstration {index}: {reason}" for reason in reasons))
    print(f"{len(done.kept)} sound demonstrations are in {done.root}, numbered from 0.")
    if done.set_aside:
        print(f"{len(done.set_aside)} damaged ones were set aside in {done.root / SET_ASIDE}.")
    return 0


def _ways(settings: InspectSettings, source: Source | None) -> Ways | None:
    """The sequences of a sound source, if they are asked for.

    Raises:
        ConfigError: the source has no steps, or `--segments` is given without `--sequences`.
        PoolError: the table of segments or the labels are damaged.
    """
    from teasim.cli.sequences import ways_of
    from teasim.common.errors import ConfigError

    if settings.segments is not None and not settings.sequences:
        raise ConfigError("--segments is for --sequences; add '--sequences'.")
    return ways_of(source, settings.segments) if settings.sequences and source else None


def _shown(ways: Ways | None) -> dict[str, Any]:
    from teasim.cli.sequences import sequences_json

    return {} if ways is None else sequences_json(ways)


def _leakage(source: Source) -> dict[str, float]:
    """AUROC of every clue.

    Raises:
        PoolError: the source has no labels, or is of a format that stores none.
    """
    from teasim.pool import Pool
    from teasim.pool.leakage import leakage

    return leakage(Pool.open(source.root))


def _leakage_text(clues: dict[str, float]) -> str:
    head = "Leakage (AUROC of one clue alone, incorrect against correct; 0.5 is chance):"
    return "\n".join([head, *(f"  {name:20}{value:.2f}" for name, value in clues.items())])
