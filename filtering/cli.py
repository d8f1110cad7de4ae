"""The verbs `filter` and `segment`; heavy modules are imported only when a verb runs."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from filtering.config import FilterConfig
from filtering.segmentation.config import FitConfig
from teasim.common.cli import parse
from teasim.common.errors import ConfigError
from teasim.common.figures import check_figures, save_figures
from teasim.common.workers import WorkerOptions, Workers
from teasim.pool.readers.reader import ReadOptions

if TYPE_CHECKING:
    from filtering.demo_filter import DemoFilter
    from teasim.pool.source import Source

Out = Annotated[Path, tyro.conf.arg(aliases=["-o"])]

FILTER_EXAMPLES = (
    "teasim filter pool -o filtered",
    "teasim filter pool -o filtered --segmenter clustering --threshold 0.3",
)
SEGMENT_EXAMPLES = (
    "teasim segment fit pool -o segmenter --labelled 12",
    "teasim segment predict segmenter other_pool -o predicted",
)


@dataclass(frozen=True)
class FilterCommand:
    """Give every demonstration of a pool a weight and flag the incorrect ones."""

    source: Annotated[Path, tyro.conf.Positional]
    """The demonstrations: a LeRobot data set (or its name on the Hugging Face Hub, if a copy is in
    the local cache), a robomimic file, a Minari data set, a folder of ALOHA episodes or of videos,
    or an MS-TCN folder (one label per frame, without videos)."""
    out: Out
    """Folder for weights.csv, segments.csv, filter.json, keep.txt, exclude.txt and report.html."""
    config: Annotated[FilterConfig, tyro.conf.OmitArgPrefixes]
    """Settings of the filter."""
    options: Annotated[ReadOptions, tyro.conf.OmitArgPrefixes]
    """What the format of the source does not store."""
    task: str | None = None
    """Judge the demonstrations of this task alone. By default those of each task are judged by
    themselves."""
    max_flagged: float = 1.0
    """Exit with code 1 if more than this share of the demonstrations is flagged, 0 to 1."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""
    overwrite: bool = False
    """Replace the output of an earlier filter in the output folder."""
    figures: Path | None = None
    """Folder for figures as SVG and PNG; needs `pip install teasim[figures]`."""
    embed: Literal["auto", "all", "none"] = "auto"
    """Put the videos into report.html (all), or into the folder videos beside it (none). auto: into
    the page if they have at most 12 MB."""

    def __post_init__(self) -> None:
        """Raise ConfigError if `max_flagged` is not a share."""
        if not 0.0 <= self.max_flagged <= 1.0:
            raise ConfigError(f"--max-flagged is {self.max_flagged}; choose a share from 0 to 1.")


@dataclass(frozen=True)
class FitCommand:
    """Fit MS-TCN++ to the labelled sub-tasks of some demonstrations of a pool."""

    pool: Annotated[Path, tyro.conf.Positional]
    """The pool, with labelled sub-tasks."""
    out: Out
    """New folder for the segmenter."""
    config: Annotated[FitConfig, tyro.conf.OmitArgPrefixes]
    """Settings of the fit."""
    figures: Path | None = None
    """Folder for figures as SVG and PNG; needs `pip install teasim[figures]`."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""


@dataclass(frozen=True)
class PredictCommand:
    """Label the frames of a pool, or of an MS-TCN folder with features."""

    segmenter: Annotated[Path, tyro.conf.Positional]
    """Folder that `teasim segment fit` made."""
    source: Annotated[Path, tyro.conf.Positional]
    """The pool, or a folder with mapping.txt and features/*.npy."""
    out: Out
    """New folder for predictions, posteriors and, where the true labels are known, metrics.json."""
    figures: Path | None = None
    """Folder for figures as SVG and PNG; needs `pip install teasim[figures]`."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""


SegmentCommand = (
    Annotated[FitCommand, tyro.conf.subcommand("fit")]
    | Annotated[PredictCommand, tyro.conf.subcommand("predict")]
)


def main(argv: Sequence[str] | None = None) -> int:
    """Give every demonstration of a pool a weight and flag the incorrect ones.

    Returns:
        0, or 1 if more demonstrations are flagged than --max-flagged allows.

    Raises:
        TeasimError: the pool is damaged or a setting is out of range (exit code 2).
    """
    return _filter(parse(FilterCommand, argv, verb="filter", examples=FILTER_EXAMPLES))


def segment(argv: Sequence[str] | None = None) -> int:
    """Fit a segmenter to labelled demonstrations, or find the sub-tasks in videos with it.

    Raises:
        TeasimError: the pool is damaged or a setting is out of range (exit code 2).
    """
    description = "Fit a segmenter to labelled demonstrations, or find the sub-tasks in videos."
    command: FitCommand | PredictCommand = parse(
        SegmentCommand,  # type: ignore[arg-type]
        argv,
        verb="segment",
        examples=SEGMENT_EXAMPLES,
        description=description,
    )
    return _fit(command) if isinstance(command, FitCommand) else _predict(command)


def _filter(command: FilterCommand) -> int:
    from filtering.by_task import fit_by_task, of_task
    from filtering.output import check_output, write_filter_output
    from filtering.report.figures import save_filter_figures
    from teasim.pool.readers.registry import open_source
    from teasim.pool.soundness import print_notes

    check_figures(command.figures)
    pool = open_source(command.source, command.options)
    print_notes(pool)
    check_output(command.out, pool.root, overwrite=command.overwrite)
    if command.task is not None:
        pool = of_task(pool, command.task)
    fitted = fit_by_task(command.config, pool, workers=command.workers)
    write_filter_output(
        command.out,
        pool,
        fitted,
        overwrite=command.overwrite,
        embed=command.embed,
        workers=command.workers,
    )
    if command.figures is not None:
        save_filter_figures(command.figures, pool, fitted)
    _print_result(pool, fitted)
    page = command.out / "report.html"
    print(f"report: {page}" if page.exists() else f"weights: {command.out / 'weights.csv'}")
    return 1 if float(fitted.flagged_.mean()) > command.max_flagged else 0


def basis(fitted: "DemoFilter") -> str:
    """Return a sentence on what the demonstrations were judged by."""
    chosen, cameras = fitted.chosen_, ", ".join(fitted.cameras_)
    if chosen.score == "moments":
        return f"Judged by moments of the videos alone (camera {cameras})."
    if chosen.score == "combined":
        if chosen.segmenter != "clustering":
            return (
                f"Judged by moments of the videos (camera {cameras}), and by sub-tasks that the "
                f"segmenter '{chosen.segmenter}' found in them."
            )
        return f"Judged by moments and found sub-tasks of the videos alone (camera {cameras})."
    if chosen.segmenter == "logged":
        if cameras or not fitted.effects_:
            return "Judged by the logged sub-tasks."
        return (
            "Judged by the logged sub-tasks, and by what they change in the logged state of the "
            "environment."
        )
    if chosen.segmenter == "predictions":
        return "Judged by the predictions stored in the folder."
    if chosen.segmenter == "clustering":
        return f"Judged by sub-tasks found in the videos alone (camera {cameras})."
    return f"Judged by sub-tasks that the segmenter '{chosen.segmenter}' found in the videos."


def _print_result(pool: "Source", fitted: "DemoFilter") -> None:
    print(basis(fitted))
    print(f"cameras looked at: {', '.join(fitted.looked_at_) or 'none'}")
    confidence = fitted.segments_.confidence()
    if confidence is not None:
        count = len(fitted.segments_.subtasks)
        found = "1 sub-task" if count == 1 else f"{count} sub-tasks"
        print(f"{found}, recognised with a mean probability of {confidence:.2f}.")
    names = [demo.name for demo in pool.episodes]
    if not fitted.tasks_:
        _print_verdicts(fitted, names, range(len(names)), fitted.words_)
        return
    for task in fitted.tasks_:
        if task.judged:
            print(f"\nTask '{task.name}':")
            _print_verdicts(fitted, names, task.rows, task.words)
    print("", *(task.words[0] for task in fitted.tasks_ if not task.judged), sep="\n")
    flagged, count = int(fitted.flagged_.sum()), len(names)
    print(f"In all, {flagged} of {count} demonstrations of {len(fitted.tasks_)} tasks are flagged.")


def _print_verdicts(
    fitted: "DemoFilter", names: Sequence[str], rows: Sequence[int], words: Sequence[str]
) -> None:
    """Print what is said about some demonstrations, and about them as a whole."""
    table = fitted.table()
    for row in rows:
        if table[row].reason:
            print(f"{names[row]}  weight {table[row].weight:.2f}  {table[row].reason}")
    flagged = sum(table[row].flagged for row in rows)
    print(f"{flagged} of {len(rows)} demonstrations are flagged.")
    for sentence in words:
        print(sentence)


def _fit(command: FitCommand) -> int:
    from filtering.segmentation.fit import fit_segmenter
    from filtering.segmentation.scoring import scores_table

    check_figures(command.figures)
    result = fit_segmenter(command.pool, command.out, command.config, workers=command.workers)
    for name in result.never_shown:
        print(
            f"teasim: warning: no labelled demonstration shows '{name}', which others of the pool "
            "do; the segmenter cannot find it.",
            file=sys.stderr,
        )
    numbers = ", ".join(map(str, result.labelled))
    print(f"fitted to {len(result.labelled)} demonstrations: {numbers}")
    if command.figures is not None:
        save_figures(command.figures, result.figures)
    print(scores_table(result.scores))
    print(f"segmenter: {command.out}")
    return 0


def _predict(command: PredictCommand) -> int:
    from filtering.segmentation.figures import folder_figures
    from filtering.segmentation.predict import predict
    from filtering.segmentation.scoring import scores_table
    from teasim.pool.mstcn.folder import MSTCNFolder

    check_figures(command.figures)
    scores = predict(command.segmenter, command.source, command.out, workers=command.workers)
    if command.figures is not None:
        save_figures(command.figures, folder_figures(MSTCNFolder.open(command.out)))
    print(scores_table(scores) if scores else "Nothing is scored: the true labels are not known.")
    print(f"predictions: {command.out / 'predictions'}")
    return 0
