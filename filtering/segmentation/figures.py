"""The figures of a segmenter: what it takes each sub-task for, and its timelines."""

from collections.abc import Sequence

import numpy as np

from teasim.common.figures import Bar, ConfusionFigure, Drawing, TimelinesFigure
from teasim.pool import Span
from teasim.pool.mstcn.folder import MSTCNFolder
from teasim.pool.types import runs

NOTHING = "no sub-task"
"""Name of frames that belong to no sub-task."""
MOST_TIMELINES = 20
"""Most videos whose timelines are drawn: as many as can be read on a page."""

Spans = tuple[Span, ...]


def segmenter_figures(
    names: Sequence[str], true: Sequence[Spans], found: Sequence[Spans], fps: float | None
) -> dict[str, Drawing]:
    """Return confusion and timelines of videos with labels; nothing where there are none.

    Args:
        names: of the videos.
        true: per video its labelled spans; empty where it has none.
        found: per video the spans that the segmenter found.
        fps: frames per second; None where it is not known.
    """
    known = [number for number, spans in enumerate(true) if spans]
    if not known:
        return {}
    shown = known[:MOST_TIMELINES]
    confused = confusion([true[number] for number in known], [found[number] for number in known])
    return {
        "confusion": confused,
        "timelines": TimelinesFigure(
            names=tuple(names[number] for number in shown),
            found=tuple(_bars(found[number], fps) for number in shown),
            true=tuple(_bars(true[number], fps) for number in shown),
            subtasks=tuple(name for name in confused.names if name != NOTHING),
            unit="frames" if fps is None else "s",
        ),
    }


def folder_figures(folder: MSTCNFolder) -> dict[str, Drawing]:
    """Return the figures of the predictions in an MS-TCN folder; nothing without true labels."""
    known = {video: folder.truth(video) for video in folder.videos}
    pairs = [
        (truth, folder.predictions(video)) for video, truth in known.items() if truth is not None
    ]
    true, found = (
        ([_spans(labels, folder.names) for labels in side] for side in zip(*pairs, strict=True))
        if pairs
        else ([], [])
    )
    return segmenter_figures([v for v, t in known.items() if t is not None], true, found, None)


def confusion(true: Sequence[Spans], found: Sequence[Spans]) -> ConfusionFigure:
    """Return the numbers of frames by true and by predicted label, over all videos."""
    named = dict.fromkeys(span.subtask for spans in (*true, *found) for span in spans)
    names = (*named, NOTHING)
    counts = np.zeros((len(names), len(names)), dtype=np.int64)
    for pair in zip(true, found, strict=True):
        length = max(spans[-1].stop for spans in pair if spans)
        rows, columns = (_labels(spans, names, length) for spans in pair)
        np.add.at(counts, (rows, columns), 1)
    used = np.flatnonzero(counts.sum(axis=0) + counts.sum(axis=1))
    return ConfusionFigure(
        tuple(names[number] for number in used), tuple(map(tuple, counts[np.ix_(used, used)]))
    )


def _spans(labels: np.ndarray, names: Sequence[str]) -> Spans:
    return tuple(
        Span(names[run.label], run.start, run.stop)
        for run in runs(labels)
        if 0 <= run.label < len(names)
    )


def _labels(spans: Spans, names: Sequence[str], length: int) -> np.ndarray:
    labels = np.full(length, len(names) - 1)
    for span in spans:
        labels[span.start : span.stop] = names.index(span.subtask)
    return labels


def _bars(spans: Spans, fps: float | None) -> tuple[Bar, ...]:
    rate = fps or 1.0
    return tuple(Bar(s.subtask, s.start / rate, s.stop / rate) for s in spans)
