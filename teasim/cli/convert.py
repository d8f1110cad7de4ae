"""The verbs `convert` and `label`: a copy of a source in another format, or with other labels."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from teasim.common.cli import parse, resumable
from teasim.common.errors import Interrupted
from teasim.common.workers import WorkerOptions, Workers

if TYPE_CHECKING:
    from teasim.pool.writers.content import Choice
    from teasim.pool.writers.writer import Writer

Format = Literal["lerobot", "lerobot-v2.1", "robomimic", "minari", "videos", "ms-tcn"]

EXAMPLES = (
    "teasim convert demo.hdf5 pool --to lerobot",
    "teasim convert pool kept --weights findings/weights.csv --drop-flagged",
)
LABEL_EXAMPLES = (
    "teasim label videos --segments f/segments.csv --names n.txt -o named",
    "teasim label pool --segments f/segments.csv --names n.json -o out --to ms-tcn",
)


@dataclass(frozen=True)
class ReadSettings:
    """What a source does not say about itself."""

    fps: float | None = None
    """Frames per second [1/s] of a source that does not store them."""
    mask: str | None = None
    """Read only the demonstrations of this mask of a robomimic file, e.g. train."""
    background_label: tuple[str, ...] = ()
    """Further labels of frames that belong to no sub-task of an MS-TCN folder, beside background,
    SIL, action_start and action_end."""


@dataclass(frozen=True)
class ConvertSettings(ReadSettings):
    """Write a copy of a source in another format, with labels and verdicts."""

    source: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder or file with demonstrations, in any format that `teasim filter` reads."""
    dest: tyro.conf.Positional[Path] = tyro.MISSING
    """New folder, or new file with the ending .hdf5 for robomimic. The same command continues an
    interrupted conversion."""
    to: Format = tyro.MISSING
    """Format of the copy."""
    weights: Path | None = None
    """weights.csv of `teasim filter`: verdicts are written in the forms that the format has."""
    segments: Path | None = None
    """segments.csv of `teasim filter`: segments that were found replace logged sub-tasks; in an
    MS-TCN folder they become predictions."""
    names: Path | None = None
    """Names of the sub-tasks: a file of lines 'step 1 = pour water', or a JSON object."""
    drop_flagged: tyro.conf.FlagCreatePairsOff[bool] = False
    """Leave out the demonstrations that are flagged in the weight table. The others are numbered
    anew; each keeps its demo_id."""
    camera: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Camera whose pictures are written; may be repeated, all cameras by default."""
    language: tyro.conf.FlagCreatePairsOff[bool] = False
    """Also write the sub-tasks of a LeRobot data set as sentences (language_persistent), which
    LeRobot trains on since version 0.6 and cannot open before it."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""


@dataclass(frozen=True)
class LabelSettings(ReadSettings):
    """Write a copy of a source with named sub-tasks."""

    source: tyro.conf.Positional[Path] = tyro.MISSING
    """Folder or file with demonstrations, in any format that `teasim filter` reads."""
    segments: Path = tyro.MISSING
    """segments.csv of `teasim filter`."""
    names: Path = tyro.MISSING
    """Names of the segments: a file of lines 'step 1 = pour water', or a JSON object. Segments
    with the same name become one sub-task."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])] = tyro.MISSING
    """New folder or file for the copy."""
    to: Format | None = None
    """Format of the copy; by default that of the source."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""


@resumable
def main(argv: Sequence[str] | None = None) -> int:
    """Write a copy of a source in another format, with labels and verdicts.

    Raises:
        TeasimError: bad input, which the command turns into exit code 2.
    """
    settings = parse(ConvertSettings, argv, verb="convert", examples=EXAMPLES)
    from teasim.pool.segments_table import read_segments_table
    from teasim.pool.weight_table import read_weight_table
    from teasim.pool.writers.content import Choice
    from teasim.pool.writers.registry import writer_named
    from teasim.pool.writers.subtask_names import read_names

    choice = Choice(
        cameras=settings.camera,
        weights=read_weight_table(settings.weights) if settings.weights else None,
        segments=read_segments_table(settings.segments) if settings.segments else None,
        names=read_names(settings.names) if settings.names else None,
        drop_flagged=settings.drop_flagged,
        language=settings.language,
    )
    writer = writer_named(settings.to)
    return _write(settings, writer, choice, settings.dest)


@resumable
def label(argv: Sequence[str] | None = None) -> int:
    """Give names to sub-tasks that were found, in a copy of the source.

    Raises:
        TeasimError: bad input, which the command turns into exit code 2.
    """
    settings = parse(LabelSettings, argv, verb="label", examples=LABEL_EXAMPLES)
    from teasim.pool.segments_table import read_segments_table
    from teasim.pool.writers.content import Choice
    from teasim.pool.writers.registry import writer_like, writer_named
    from teasim.pool.writers.subtask_names import read_names

    choice = Choice(
        segments=read_segments_table(settings.segments), names=read_names(settings.names)
    )
    writer = writer_named(settings.to) if settings.to else writer_like(settings.source)
    return _write(settings, writer, choice, settings.out)


def _write(
    settings: ConvertSettings | LabelSettings, writer: "Writer", choice: "Choice", dest: Path
) -> int:
    from teasim.pool.readers.reader import ReadOptions
    from teasim.pool.readers.registry import open_source
    from teasim.pool.soundness import print_notes, require_sound
    from teasim.pool.writers.content import content_of
    from teasim.pool.writers.writing import kept, staging_of, write

    options = ReadOptions(settings.fps, settings.mask, settings.background_label)
    source = open_source(settings.source, options)
    require_sound(source)
    print_notes(source)
    content = content_of(source, choice)
    try:
        notes = write(writer, source, content, dest, workers=settings.workers)
    except KeyboardInterrupt:
        raise Interrupted(
            f"Interrupted; {kept(dest)} of {len(content.items)} demonstrations are kept in "
            f"'{staging_of(dest)}', run the same command again to continue."
        ) from None
    for note in notes:
        print(f"teasim: warning: {note}", file=sys.stderr)
    print(f"{len(content.items)} demonstrations in {dest} ({writer.name})")
    return 0
