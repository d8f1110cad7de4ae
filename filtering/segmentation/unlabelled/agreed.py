"""Segments from agreement: the sub-tasks that most videos show, without a label."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from filtering.moments.agreement import Agreement, agree
from filtering.moments.counterparts import Counterparts
from filtering.segmentation.segments import Segmentation
from filtering.vision.frame_features import sampled_frames
from teasim.pool import Span


def agreed_segments(found: Mapping[str, Counterparts], lengths: Sequence[int]) -> Segmentation:
    """Return the agreed sub-tasks as segments named 'step 1', 'step 2', ... in frames.

    Args:
        found: per camera the counterparts; the camera whose videos agree on most sub-tasks counts.
        lengths: frames of each demonstration.

    Without a border that videos agree on there are no segments.
    """
    best = max((agree(one) for one in found.values()), key=lambda a: len(a.stretches))
    if len(best.stretches) < 2:
        return Segmentation((), ((),) * len(lengths))
    names = tuple(f"step {number + 1}" for number in range(len(best.stretches)))
    moments = next(iter(found.values())).lengths
    return Segmentation(
        names,
        tuple(
            _frames_of(best, video, names, sampled_frames(length, moments[video]))
            for video, length in enumerate(lengths)
        ),
    )


def _frames_of(
    agreement: Agreement, video: int, names: Sequence[str], frames: NDArray[np.int64]
) -> tuple[Span, ...]:
    """Return the segments of a video in order of time; where two overlap the later begins later."""
    shown = [
        (*span, name)
        for name, stretch in zip(names, agreement.stretches, strict=True)
        if (span := stretch.spans[video]) is not None
    ]
    spans: list[Span] = []
    for start, stop, name in sorted(shown):
        first, last = int(frames[start]), int(frames[min(stop, len(frames)) - 1]) + 1
        first = max(first, spans[-1].stop if spans else 0)
        if last > first:
            spans.append(Span(name, first, last))
    return tuple(spans)
