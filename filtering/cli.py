"""The verb `filter`; what it needs is imported only when it runs."""

import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from teasim.errors import ConfigError, TeasimError


@dataclass(frozen=True)
class FilterArguments:
    """Give every demonstration of a pool a weight and flag the incorrect ones."""

    source: Annotated[Path, tyro.conf.Positional]
    """The pool: a LeRobot v3.0 data set with labelled sub-tasks."""
    out: Annotated[Path, tyro.conf.arg(aliases=["-o"])]
    """Folder for weights.csv, filter.json, keep.txt, exclude.txt and report.html."""
    segmenter: str = "truth"
    """Where segments come from: truth (the labels logged in the pool)."""
    score: str = "norm"
    """What demonstrations are judged by: norm (omissions, order and next steps against what most
    of the pool does) or equation3 (the paper's next-step model)."""
    solver: str = "annealed"
    """Solver of equation 3: annealed."""
    groups: str = "auto"
    """Number of groups: auto, 1 (nothing is flagged), 2 or 3."""
    camera: tuple[str, ...] = field(default=())
    """Cameras whose pictures are used; the main one if none is named."""
    frames_per_segment: int = 64
    """Most frames looked at in a segment."""
    background: str = "median"
    """Background subtraction: none, median or mog2."""
    max_flagged: float = 1.0
    """Exit with 1 when more than this share of the demonstrations is flagged, 0 to 1."""
    jobs: int = 0
    """Worker processes; 0 means one per core."""
    overwrite: bool = False
    """Replace an earlier filter's output in the output folder."""
    debug: bool = False
    """Show the traceback of an error."""


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
    from filtering.demo_filter import DemoFilter, FilterConfig
    from filtering.output import check_output, write_filter_output
    from teasim import parallel
    from teasim.pool import Pool

    if not 0.0 <= arguments.max_flagged <= 1.0:
        raise ConfigError(f"--max-flagged is {arguments.max_flagged}; choose a share from 0 to 1.")
    config = FilterConfig(
        segmenter=arguments.segmenter,
        score=arguments.score,
        solver=arguments.solver,
        groups=arguments.groups,
        cameras=arguments.camera,
        frames_per_segment=arguments.frames_per_segment,
        background=arguments.background,
    )
    pool = Pool.open(arguments.source)
    check_output(arguments.out, pool.root, overwrite=arguments.overwrite)
    jobs = arguments.jobs or parallel.default_jobs()
    fitted = DemoFilter(config).fit(pool, jobs=jobs)
    write_filter_output(arguments.out, pool, fitted, overwrite=arguments.overwrite)
    for row in fitted.table():
        if row.flagged:
            print(f"video {row.episode_index}  weight {row.weight:.2f}  {row.reason}")
    share = float(fitted.flagged_.mean())
    print(f"{int(fitted.flagged_.sum())} of {len(fitted.weights_)} demonstrations are flagged.")
    print(f"report: {arguments.out / 'report.html'}")
    return 1 if share > arguments.max_flagged else 0
