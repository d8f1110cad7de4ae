"""The figures of a filter's result, for papers and slides: from what the page shows."""

from pathlib import Path

import numpy as np

from filtering.demo_filter import DemoFilter
from filtering.judging.explain import Clock
from filtering.judging.places import usual_order
from teasim.common.figures import (
    Bar,
    Drawing,
    PrecedenceFigure,
    ReliabilityFigure,
    TimelinesFigure,
    WeightsFigure,
    save_figures,
)
from teasim.pool import Span
from teasim.pool.source import Source

MOST_TIMELINES = 30
"""Most demonstrations whose timelines are drawn: as many as can be read on a page."""


def save_filter_figures(folder: Path, pool: Source, fitted: DemoFilter) -> None:
    """Write the figures of a fitted filter to `folder`: weights, timelines, precedence.

    Where all labels are known also reliability; nothing else depends on them but the order and the
    names of what is drawn.

    Raises:
        ConfigError: matplotlib is not installed, or the folder is a file.
        TeasimError: a file cannot be written.
    """
    records = [episode.record for episode in pool.episodes]
    drawings: dict[str, Drawing] = {
        "weights": WeightsFigure(
            tuple(fitted.weights_.tolist()),
            tuple(fitted.flagged_.tolist()),
            tuple(record.sequence if record else "" for record in records),
            fitted.threshold_,
        ),
        "timelines": timelines(pool, fitted),
        "precedence": precedence(fitted),
    }
    known = [record for record in records if record is not None]
    if len(known) == len(records):
        drawings["reliability"] = ReliabilityFigure(
            tuple(fitted.probabilities_.tolist()), tuple(not record.correct for record in known)
        )
    save_figures(folder, drawings)


def timelines(pool: Source, fitted: DemoFilter) -> TimelinesFigure:
    """Return the timelines of the lowest weights, in the order of the pool."""
    clock = Clock(pool.fps)
    lowest = np.argsort(fitted.weights_, kind="stable")[:MOST_TIMELINES]
    chosen = sorted(int(demo) for demo in lowest)
    logged = fitted.chosen_.segmenter == "logged"
    return TimelinesFigure(
        names=tuple(pool.episodes[demo].name for demo in chosen),
        found=tuple(bars(fitted.segments_.spans[demo], clock) for demo in chosen),
        true=tuple(() if logged else bars(pool.episodes[demo].spans(), clock) for demo in chosen),
        subtasks=fitted.segments_.subtasks,
        unit=clock.unit,
    )


def precedence(fitted: DemoFilter) -> PrecedenceFigure:
    """Return the order of the sub-tasks in the demonstrations, by their trust."""
    segments = fitted.segments_
    before = usual_order(segments.labels(), fitted.trust_, len(segments.subtasks))
    return PrecedenceFigure(segments.subtasks, tuple(map(tuple, before.tolist())))


def bars(spans: tuple[Span, ...], clock: Clock) -> tuple[Bar, ...]:
    """Return segments on a timeline of a figure."""
    return tuple(Bar(s.subtask, clock.time(s.start), clock.time(s.stop)) for s in spans)
