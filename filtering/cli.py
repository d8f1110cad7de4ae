"""The verbs `segment` and `filter`; what they need is imported only when they run."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from teasim.common.errors import ConfigError, TeasimError

if TYPE_CHECKING:
    from filtering.demo_filter import DemoFilter
    from teasim.pool.source import Source


@dataclass(frozen=True)
class FilterArguments:
    """Give every demonstration of a pool a weight and flag the incorrect ones."""

    source: Annotated[Path, tyro.conf.Positional]
    """The demonstrations: a LeRobot v3.0 data set, a robomimic file, a Minari data set, a folder of
    ALOHA episodes or of videos, or an MS-TCN folder (labels per frame in groundTruth/*.txt or
    predictions/*.txt, mapping.txt) without videos."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Folder for weights.csv, filter.json, keep.txt, exclude.txt and report.html."""
    segmenter: str = "logged"
    """Where segments come from: logged (the sub-tasks logged in the pool), clustering (the videos
    alone, without labels), predictions (those stored in an MS-TCN folder), or the folder of a
    segmenter that `teasim segment fit` made."""
    subtasks: str = "auto"
    """Number of sub-tasks that clustering looks for; auto finds it out."""
    score: str = "norm"
    """What demonstrations are judged by: norm (omissions, order and next steps against what most
    of the pool does) or equation3 (the paper's next-step model)."""
    solver: str = "annealed"
    """Solver of equation 3: annealed, alternating, exact (24 different demonstrations at most) or
    published (SciPy's SLSQP without a ridge)."""
    groups: str = "auto"
    """Number of groups: auto (kept, and of the score norm what is out of order and where steps are
    left out), 1 (nothing is flagged), 2 or 3."""
    threshold: str = "auto"
    """How the threshold is found: auto (the score's own rule), or the mid-points between groups of
    weights by kmeans, gmm or minibatch."""
    precedence: Path | None = None
    """File of lines 'a before b' (or a JSON list of pairs): no other order counts then. Of norm."""
    tolerance: float = 0.0
    """How much what a minority does is let pass, 0 to below 1; 0.2 spares shared legal orders. Of
    the score norm."""
    camera: tuple[str, ...] = field(default=())
    """Cameras whose pictures are used; the main one if none is named."""
    effects: bool = True
    """Look at the video before and after each segment, in all cameras unless some are named: a step
    of which nothing came is as bad as one left out. Of the score norm."""
    frames_per_segment: int = 64
    """Most frames looked at in a segment. Of the score equation3."""
    background: str = "median"
    """Background subtraction: none, median or mog2. Of the score equation3."""
    features: str = "pooled"
    """What describes a segment for equation3: pooled (nothing is learned), or the folder of a
    segmenter that `teasim segment fit --features` made."""
    fps: float | None = None
    """Frames per second of a source that does not store it; times of an MS-TCN folder are in frames
    if not given."""
    mask: str | None = None
    """Read only the demonstrations of this mask of a robomimic file, e.g. train."""
    background_label: tuple[str, ...] = ()
    """Further labels of frames that belong to no sub-task of an MS-TCN folder, beside background,
    SIL, action_start and action_end (--background is about background subtraction)."""
    max_flagged: float = 1.0
    """Exit with 1 when more than this share of the demonstrations is flagged, 0 to 1."""
    jobs: int = 0
    """Worker processes; 0 means one per core."""
    overwrite: bool = False
    """Replace an earlier filter's output in the output folder."""
    debug: bool = False
    """Show the traceback of an error."""


@dataclass(frozen=True)
class FitArguments:
    """Fit MS-TCN++ to the labelled sub-tasks of some demonstrations of a pool."""

    pool: Annotated[Path, tyro.conf.Positional]
    """The pool: a LeRobot v3.0 data set with labelled sub-tasks."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """New folder for the segmenter."""
    episodes: tuple[int, ...] = ()
    """Numbers of the demonstrations whose labels are used; drawn by chance if none is given."""
    labelled: int | None = None
    """How many to draw of those that have labels; 12, or all if they are fewer, if not given."""
    epochs: int = 100
    """Times every video is shown."""
    camera: tuple[str, ...] = field(default=())
    """Cameras whose pictures are used; all if none is named."""
    rate: float = 2.5
    """Moments looked at per second of video."""
    scaling: str = "video"
    """Scale features within each video (video), or by the training set alone (training)."""
    rearranged: float = 0.5
    """Chance that a video is shown with its segments in a random order, 0 to 1."""
    features: bool = False
    """Also learn what tells the segments of sub-tasks apart, for `teasim filter --features`."""
    seed: int = 0
    """Seed of the network, and of the draw."""
    jobs: int = 0
    """Worker processes; 0 means one per core."""


@dataclass(frozen=True)
class PredictArguments:
    """Label the frames of a pool, or of an MS-TCN folder with features."""

    segmenter: Annotated[Path, tyro.conf.Positional]
    """Folder that `teasim segment fit` made."""
    source: Annotated[Path, tyro.conf.Positional]
    """The pool, or a folder with mapping.txt and features/*.npy."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """New folder for predictions, posteriors and, where the truth is known, metrics.json."""
    jobs: int = 0
    """Worker processes; 0 means one per core."""


SegmentArguments = (
    Annotated[FitArguments, tyro.conf.subcommand("fit")]
    | Annotated[PredictArguments, tyro.conf.subcommand("predict")]
)


def segment(argv: Sequence[str] | None = None) -> int:
    """Fit a segmenter to labelled demonstrations, or find the sub-tasks in videos with it.

    Raises:
        TeasimError: bad input, which the command turns into exit code 2.
    """
    arguments: FitArguments | PredictArguments = tyro.cli(
        SegmentArguments,
        args=argv,
        prog="teasim segment",
        description="Fit a segmenter to labelled demonstrations, or find the sub-tasks in videos.",
    )
    return _fit(arguments) if isinstance(arguments, FitArguments) else _predict(arguments)


def main(argv: Sequence[str] | None = None) -> int:
    """Give every demonstration of a pool a weight and flag the incorrect ones.

    Returns:
        0 done, 1 more demonstrations flagged than --max-flagged allows, 2 bad input.
    """
    arguments = tyro.cli(FilterArguments, args=argv, prog="teasim filter")
    try:
        return run(arguments)
    except TeasimError as error:
        if arguments.debug:
            raise
        print(f"teasim: {error}", file=sys.stderr)
        return 2


def run(arguments: FilterArguments) -> int:
    """Filter a pool; see `main` for the result.

    Raises:
        TeasimError: the pool is damaged, or an argument is out of range.
    """
    from filtering.config import FilterConfig
    from filtering.demo_filter import DemoFilter
    from filtering.judging.norm.precedence import read_precedence
    from filtering.output import check_output, write_filter_output
    from teasim.common import parallel
    from teasim.pool.readers.reader import ReadOptions
    from teasim.pool.readers.registry import open_source
    from teasim.pool.soundness import print_notes

    if not 0.0 <= arguments.max_flagged <= 1.0:
        raise ConfigError(f"--max-flagged is {arguments.max_flagged}; choose a share from 0 to 1.")
    config = FilterConfig(
        segmenter=arguments.segmenter,
        subtasks=arguments.subtasks,
        score=arguments.score,
        solver=arguments.solver,
        groups=arguments.groups,
        threshold=arguments.threshold,
        precedence=read_precedence(arguments.precedence) if arguments.precedence else (),
        tolerance=arguments.tolerance,
        cameras=arguments.camera,
        frames_per_segment=arguments.frames_per_segment,
        background=arguments.background,
        features=arguments.features,
        effects=arguments.effects,
    )
    options = ReadOptions(arguments.fps, arguments.mask, arguments.background_label)
    pool = open_source(arguments.source, options)
    print_notes(pool)
    check_output(arguments.out, pool.root, overwrite=arguments.overwrite)
    jobs = arguments.jobs or parallel.default_jobs()
    fitted = DemoFilter(config).fit(pool, jobs=jobs)
    write_filter_output(arguments.out, pool, fitted, overwrite=arguments.overwrite)
    _print_result(pool, fitted, arguments.out)
    return 1 if float(fitted.flagged_.mean()) > arguments.max_flagged else 0


def _print_result(pool: "Source", fitted: "DemoFilter", out: Path) -> None:
    from filtering.demo_filter import caution

    confidence = fitted.segments_.confidence()
    if confidence is not None:
        found = len(fitted.segments_.subtasks)
        print(f"{found} sub-tasks, recognised with a mean probability of {confidence:.2f}.")
    names = {demo.demo_id: demo.name for demo in pool.episodes}
    for row in fitted.table():
        if row.flagged:
            print(f"{names[row.demo_id]}  weight {row.weight:.2f}  {row.reason}")
    print(f"{int(fitted.flagged_.sum())} of {len(fitted.weights_)} demonstrations are flagged.")
    warning = caution(len(fitted.weights_))
    if warning is not None:
        print(warning)
    print(f"report: {out / 'report.html'}")


def _fit(arguments: FitArguments) -> int:
    from filtering.segmentation.fitting import FitConfig, fit_segmenter
    from filtering.segmentation.mstcn_training import MSTCNConfig
    from filtering.segmentation.scoring import scores_table
    from teasim.common import parallel

    config = FitConfig(
        episodes=arguments.episodes,
        labelled=arguments.labelled,
        cameras=arguments.camera,
        rate=arguments.rate,
        features=arguments.features,
        network=MSTCNConfig(
            epochs=arguments.epochs,
            scaling=arguments.scaling,
            rearranged=arguments.rearranged,
            seed=arguments.seed,
        ),
    )
    jobs = arguments.jobs or parallel.default_jobs()
    result = fit_segmenter(arguments.pool, arguments.out, config, jobs=jobs)
    for name in result.never_shown:
        print(
            f"teasim: warning: no labelled demonstration shows '{name}', which others of the pool "
            "do; the segmenter cannot find it.",
            file=sys.stderr,
        )
    print(f"fitted to {len(result.labelled)} demonstrations: {_listed(result.labelled)}")
    print(scores_table(result.scores))
    if result.effects:
        read = (f"{name} {100 * share:.0f} %" for name, share in result.effects.items())
        print(f"effects read in videos not learned from, balanced accuracy: {', '.join(read)}")
    print(f"segmenter: {arguments.out}")
    return 0


def _predict(arguments: PredictArguments) -> int:
    from filtering.segmentation.fitting import predict
    from filtering.segmentation.scoring import scores_table
    from teasim.common import parallel

    jobs = arguments.jobs or parallel.default_jobs()
    scores = predict(arguments.segmenter, arguments.source, arguments.out, jobs=jobs)
    print(scores_table(scores) if scores else "The truth is not known, so nothing is scored.")
    print(f"predictions: {arguments.out / 'predictions'}")
    return 0


def _listed(numbers: Sequence[int]) -> str:
    return ", ".join(map(str, numbers))
