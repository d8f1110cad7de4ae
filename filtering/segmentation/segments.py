"""The result of a segmenter, and the decoding of frame posteriors to segments."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from filtering.vision.frame_features import sampled_frames
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Span
from teasim.pool.source import Source
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
    """Per demonstration (frames, T): probability of each sub-task in each frame; 1 minus the sum of
    a row is the probability of no sub-task. None where the segmenter gives none."""
    labelled: frozenset[str] = frozenset()
    """demo_id of the demonstrations whose true labels the segmenter was fitted to."""
    cameras: tuple[str, ...] = ()
    """Cameras whose pictures were looked at; empty where segments were given."""
    weights_sha256: str | None = None
    """Hash of the weights of the segmenter; None where segments were given."""
    told: bool = False
    """Whether people or the environment labelled the segments, not a segmenter."""

    def labels(self) -> list[list[int]]:
        """Return per demonstration the label numbers of its segments, 0..T-1."""
        return label_numbers(self.spans, self.subtasks)

    def confidence(self) -> float | None:
        """Return the mean probability of the most probable label of a frame, over all frames.

        None where the segmenter gives no posteriors.
        """
        if self.posteriors is None:
            return None
        return float(np.concatenate([video.max(axis=1) for video in self.posteriors]).mean())

    def reliability(self) -> list[NDArray[np.float64]] | None:
        """Return per demonstration (q,): mean posterior of the label of each segment.

        None where the segmenter gives no posteriors.
        """
        if self.posteriors is None:
            return None
        return [
            np.array(
                [
                    video[span.start : span.stop, label].mean()
                    for span, label in zip(*demo, strict=True)
                ],
                dtype=np.float64,
            )
            for video, *demo in zip(self.posteriors, self.spans, self.labels(), strict=True)
        ]


def labels_at(
    found: Segmentation, lengths: Sequence[int], moments: Sequence[int]
) -> list[NDArray[np.int64]]:
    """Return per demonstration (n,): label of its moments, -1 where there is none.

    Args:
        found: the segments.
        lengths: frames of each demonstration.
        moments: n, moments that each was looked at in.
    """
    result = []
    for spans, labels, length, count in zip(
        found.spans, found.labels(), lengths, moments, strict=True
    ):
        frames = np.full(length, -1, dtype=np.int64)
        for span, label in zip(spans, labels, strict=True):
            frames[span.start : span.stop] = label
        result.append(frames[sampled_frames(length, count)])
    return result


def label_numbers(spans: Sequence[tuple[Span, ...]], subtasks: tuple[str, ...]) -> list[list[int]]:
    """Return per demonstration the label numbers of its segments, 0..T-1.

    Args:
        spans: per demonstration its q segments.
        subtasks: names of the T labels.
    """
    numbers = {name: number for number, name in enumerate(subtasks)}
    return [[numbers[span.subtask] for span in demo] for demo in spans]


class Segmenter(Protocol):
    """Finds the segments of every demonstration of a source."""

    def __call__(self, source: Source, /, *, workers: Workers = IN_PROCESS) -> Segmentation:
        """Return them in the order of `source.episodes`; they do not depend on `workers`."""


def decode(
    posteriors: NDArray[np.floating], shortest: Sequence[int] | None = None
) -> NDArray[np.int64]:
    """Return the label of each frame, (n,): the most probable labelling whose runs are long enough.

    A video in which no run is long enough gets the one label that is most probable over all of it.

    Args:
        posteriors: (n, C), each row sums to 1.
        shortest: C least lengths of a run of each label [frames], 1 or more; None keeps all.
    """
    if shortest is None:
        return posteriors.argmax(axis=1).astype(np.int64)
    logs = np.log(np.maximum(posteriors.astype(np.float64), TINY))
    sums = np.vstack([np.zeros(logs.shape[1]), np.cumsum(logs, axis=0)])
    # best[t, c]: the first t frames with a last run of label c that is long enough; began[t, c]:
    # where that run begins.
    best, began = np.full(sums.shape, -np.inf), np.zeros(sums.shape, np.int64)
    best[0] = 0.0
    for stop in range(1, len(sums)):
        for label, least in enumerate(shortest):
            start = stop - least
            if start < 0:
                continue
            fresh = best[start].max() + sums[stop, label] - sums[start, label]
            longer = best[stop - 1, label] + logs[stop - 1, label] if stop > 1 else -np.inf
            best[stop, label] = max(longer, fresh)
            began[stop, label] = began[stop - 1, label] if longer >= fresh else start
    if np.isfinite(best[-1]).any():
        return _trace(best, began)
    return np.full(len(posteriors), sums[-1].argmax())


def _trace(best: NDArray[np.float64], began: NDArray[np.int64]) -> NDArray[np.int64]:
    """Go back from the end over the best runs."""
    labels = np.zeros(len(best) - 1, dtype=np.int64)
    stop = len(labels)
    while stop > 0:
        label = best[stop].argmax()
        start = int(began[stop, label])
        labels[start:stop] = label
        stop = start
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
