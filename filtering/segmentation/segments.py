"""What a segmenter returns, and how frame posteriors become segments."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from teasim.pool import Pool, Span
from teasim.pool.types import runs

TINY = 1e-12
"""Least posterior whose logarithm is taken."""


@dataclass(frozen=True)
class Segmentation:
    """The segments of some demonstrations."""

    subtasks: tuple[str, ...]
    """Names of the T sub-task labels."""
    spans: tuple[tuple[Span, ...], ...]
    """Per demonstration its q segments in order of time [frames]."""
    posteriors: tuple[NDArray[np.float32], ...] | None = None
    """Per demonstration (frames, T): probability of each sub-task in each frame; what a row lacks
    to 1 is the probability of none of them. None where segments were given, not inferred."""
    labelled: frozenset[str] = frozenset()
    """demo_id of the demonstrations whose true labels the segmenter was fitted to."""
    weights_sha256: str | None = None
    """Which segmenter inferred them; None where segments were given."""

    def labels(self) -> list[list[int]]:
        """Return per demonstration the label numbers of its segments, 0..T-1."""
        numbers = {name: number for number, name in enumerate(self.subtasks)}
        return [[numbers[span.subtask] for span in spans] for spans in self.spans]

    def confidence(self) -> float | None:
        """Return the mean probability of the most probable label of a frame, over all frames.

        None where segments were given, not inferred.
        """
        if self.posteriors is None:
            return None
        return float(np.concatenate([video.max(axis=1) for video in self.posteriors]).mean())


class Segmenter(Protocol):
    """Finds the segments of every demonstration of a pool."""

    def __call__(self, pool: Pool, *, jobs: int = 1) -> Segmentation:
        """Return them in the order of `pool.episodes`; they do not depend on `jobs`."""


def decode(posteriors: NDArray[np.floating], shortest: int = 1) -> NDArray[np.int64]:
    """Return the label of each frame, (n,): the most probable, without runs below `shortest`.

    The shortest run goes first, to the neighbour whose label its frames make more probable, until
    every run has `shortest` frames or is the only one.

    Args:
        posteriors: (n, C), each row sums to 1.
        shortest: least length of a run [frames]; 1 keeps all.
    """
    labels: NDArray[np.int64] = posteriors.argmax(axis=1).astype(np.int64)
    logs = np.log(np.maximum(posteriors, TINY))
    found = runs(labels)
    while len(found) > 1:
        place = min(range(len(found)), key=lambda number: found[number].length)
        run = found[place]
        if run.length >= shortest:
            break
        beside = found[max(place - 1, 0) : place] + found[place + 1 : place + 2]
        evidence = [logs[run.start : run.stop, other.label].sum() for other in beside]
        labels[run.start : run.stop] = beside[int(np.argmax(evidence))].label
        found = runs(labels)
    return labels


def spans_of(
    labels: NDArray[np.integer], posteriors: NDArray[np.floating], subtasks: tuple[str, ...]
) -> tuple[Span, ...]:
    """Return the runs of sub-tasks among frame labels (n,); labels from T on belong to none.

    A video that shows none at all is one segment of its most probable sub-task, because a
    demonstration without segments cannot be compared with others.

    Args:
        labels: (n,) label of each frame.
        posteriors: (n, T or more).
        subtasks: names of the T sub-tasks.
    """
    spans = [
        Span(subtasks[run.label], run.start, run.stop)
        for run in runs(labels)
        if run.label < len(subtasks)
    ]
    if not spans:
        likeliest = int(posteriors[:, : len(subtasks)].sum(axis=0).argmax())
        spans = [Span(subtasks[likeliest], 0, len(labels))]
    return tuple(spans)
