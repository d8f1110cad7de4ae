"""Measures of a segmentation: those of the literature on action segmentation, and the paper's.

Frame accuracy, edit score and F1@k (Lea et al., ECCV 2016 and CVPR 2017) are computed over a set of
videos as the evaluation program of MS-TCN does it: accuracy over all frames, F1 from hits counted
over all videos, the edit score as the mean over videos. One deviation: that program lets a video's
last segment end a frame early, here every segment has all its frames.

Frames labelled NO_SUBTASK count for the frame accuracy but belong to no segment.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teasim.pool.types import NO_SUBTASK, Run, runs

OVERLAPS = (10, 25, 50)
"""Least intersection over union of a hit [%]."""
TOLERANCES = (5, 10, 20, 30)
"""Share of a segment's frames that may be wrong [%] (the paper, table 1)."""

Labels = NDArray[np.integer]
"""(n,) label of each frame of a video."""


@dataclass(frozen=True)
class LabelPair:
    """True and predicted labels of a video."""

    truth: Labels
    """(n,) true label of each frame."""
    predicted: Labels
    """(n,) label a segmenter gave it."""

    def __post_init__(self) -> None:
        """Refuse label sequences that cannot be compared."""
        if len(self.truth) != len(self.predicted) or not len(self.truth):
            raise ValueError(f"{len(self.truth)} true labels, {len(self.predicted)} predicted ones")


@dataclass(frozen=True)
class SegmentationScores:
    """Measures over a set of videos; all but the counts in %, 100 is perfect."""

    videos: int
    """Number of videos."""
    frames: int
    """Number of their frames."""
    accuracy: float
    """Share of frames with the right label."""
    edit: float
    """Mean segmental edit score."""
    f1: dict[int, float]
    """F1 of segments by least overlap."""
    subtask_accuracy: dict[int, float]
    """Share of true segments in which at most p of the frames are wrong, by p."""


def segmentation_scores(pairs: Sequence[LabelPair]) -> SegmentationScores:
    """Return all measures over one or more videos."""
    return SegmentationScores(
        videos=len(pairs),
        frames=sum(len(pair.truth) for pair in pairs),
        accuracy=frame_accuracy(pairs),
        edit=float(np.mean([edit_score(pair) for pair in pairs])),
        f1={overlap: f1_score(pairs, overlap) for overlap in OVERLAPS},
        subtask_accuracy={p: subtask_accuracy(pairs, p) for p in TOLERANCES},
    )


def frame_accuracy(pairs: Sequence[LabelPair]) -> float:
    """Return the share of right frames over all videos [%]."""
    right = sum(int((pair.truth == pair.predicted).sum()) for pair in pairs)
    return 100.0 * right / sum(len(pair.truth) for pair in pairs)


def edit_score(pair: LabelPair) -> float:
    """Return 100 (1 - distance / length of the longer), for the sequences of segment labels [%].

    The distance is Levenshtein's. Two empty sequences are equal.
    """
    truth = [run.label for run in _segments(pair.truth)]
    predicted = [run.label for run in _segments(pair.predicted)]
    longer = max(len(truth), len(predicted))
    return 100.0 if not longer else 100.0 * (1.0 - levenshtein(truth, predicted) / longer)


def levenshtein(first: Sequence[int], second: Sequence[int]) -> int:
    """Return the fewest insertions, deletions and replacements that turn one into the other."""
    row = np.arange(len(second) + 1)
    labels, columns = np.array(second), np.arange(len(second) + 1)
    for number, label in enumerate(first, start=1):
        changed = np.append(number, np.minimum(row[1:] + 1, row[:-1] + (labels != label)))
        # An insertion adds 1 to the left neighbour: a running minimum of what exceeds the column.
        row = np.minimum.accumulate(changed - columns) + columns
    return int(row[-1])


def f1_score(pairs: Sequence[LabelPair], overlap: int) -> float:
    """Return the F1 of the segments of all videos [%].

    A predicted segment looks, among the true ones of its label, for that with the largest
    intersection over union. It is a hit if that is `overlap` or more and no segment before it hit
    the same one. Where there is nothing to find and nothing found, the score is 100.

    Args:
        pairs: the videos.
        overlap: least intersection over union [%].
    """
    hits = found = existing = 0
    for pair in pairs:
        truth, predicted = _segments(pair.truth), _segments(pair.predicted)
        hits += _hits(truth, predicted, overlap)
        existing += len(truth)
        found += len(predicted)
    return 100.0 if not found + existing else 200.0 * hits / (found + existing)


def subtask_accuracy(pairs: Sequence[LabelPair], tolerance: int) -> float:
    """Return the share of true segments with at most `tolerance` % wrong frames [%].

    Where there is no segment, the score is 100.
    """
    wrong_shares = [
        (int((pair.predicted[run.start : run.stop] != run.label).sum()), run.length)
        for pair in pairs
        for run in _segments(pair.truth)
    ]
    good = sum(100 * wrong <= tolerance * length for wrong, length in wrong_shares)
    return 100.0 * good / len(wrong_shares) if wrong_shares else 100.0


def _segments(labels: Labels) -> list[Run]:
    return [run for run in runs(labels) if run.label != NO_SUBTASK]


def _hits(truth: Sequence[Run], predicted: Sequence[Run], overlap: int) -> int:
    """Count the predicted segments that hit a true one of their own."""
    taken: set[Run] = set()
    for run in predicted:
        same = [other for other in truth if other.label == run.label]
        if not same:
            continue
        best = max(same, key=lambda other: _overlap(run, other))
        if best not in taken and _overlap(run, best) >= overlap / 100.0:
            taken.add(best)
    return len(taken)


def _overlap(first: Run, second: Run) -> float:
    """Return the intersection over union of two segments, 0 where they do not touch."""
    common = min(first.stop, second.stop) - max(first.start, second.start)
    return max(common, 0) / (first.length + second.length - max(common, 0))
