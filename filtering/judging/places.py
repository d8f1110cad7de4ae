"""Where in the videos of a pool steps are, and where a missing step belongs."""

from collections.abc import Sequence

import numpy as np

from filtering.judging.explain import Finding
from teasim.common.arrays import Array
from teasim.pool import Span

NOTABLE = 1.0
"""Smallest surprise that is marked on the timeline; the largest one is always marked [nats]."""


class Supposed(Span):
    """A step that a demonstration leaves out, and may, where it would usually be."""


def usual_order(labels: Sequence[Sequence[int]], weights: Array, n_subtasks: int) -> Array:
    """Return (T, T): how often sub-task a first comes before b where both occur, 0.5 if never.

    Args:
        labels: per demonstration its q sub-task labels, 0..T-1.
        weights: (D,) how much each demonstration counts.
        n_subtasks: T.
    """
    before = np.full((n_subtasks, n_subtasks), 0.5)
    both = np.ones_like(before)
    for steps, weight in zip(labels, weights, strict=True):
        first = np.full(n_subtasks, np.inf)
        for position in range(len(steps) - 1, -1, -1):
            first[steps[position]] = position
        occurs = np.isfinite(first)
        both += weight * (occurs[:, None] & occurs[None, :])
        before += weight * ((first[:, None] < first[None, :]) & occurs[None, :])
    return before / both


def place_of(omitted: int, labels: Sequence[int], order: Array) -> int:
    """Return the row of `labels` (q,) at which an omitted sub-task fits the usual order best.

    Args:
        omitted: label of the sub-task that is missing.
        labels: the labels of the demonstration.
        order: (T, T) see `usual_order`.
    """
    agreement = [
        sum(order[label, omitted] for label in labels[:row])
        + sum(order[omitted, label] for label in labels[row:])
        for row in range(len(labels) + 1)
    ]
    return int(np.argmax(agreement))


class Places:
    """The segments of a pool with their names."""

    def __init__(self, segments: Sequence[tuple[Span, ...]], subtasks: Sequence[str]) -> None:
        """Keep per demonstration its q segments, and the names of the T labels."""
        self.segments = segments
        self.subtasks = subtasks

    def finding(self, demo: int, row: int, label: int, surprise: float) -> Finding:
        """Return the finding that `label` was expected after `row` segments; T is the end."""
        spans = self.segments[demo]
        before, later = ([s for s in part if _seen(s)] for part in (spans[:row], spans[row:]))
        seen = later[0] if later else None
        expected = self.subtasks[label] if label < len(self.subtasks) else None
        return Finding(
            expected=expected,
            seen=seen.subtask if seen else None,
            after=before[-1] if before else None,
            frame=seen.start if seen else before[-1].stop,
            missing=expected is not None and all(s.subtask != expected for s in spans),
            surprise=surprise,
            came=next((s for s in later if s.subtask == expected), None),
        )

    def extra(self, demo: int, label: int, surprise: float) -> Finding:
        """Return the finding that `label` was carried out once more than usual."""
        spans = self.segments[demo]
        last = max(row for row, span in enumerate(spans) if span.subtask == self.subtasks[label])
        return Finding(
            expected=None,
            seen=spans[last].subtask,
            after=spans[last - 1] if last else None,
            frame=spans[last].start,
            missing=False,
            surprise=surprise,
            extra=spans[last],
        )

    def ineffective(self, demo: int, losses: Array) -> list[Finding]:
        """Return the findings of ineffective steps, for what each segment adds (q,) [nats]."""
        spans = self.segments[demo]
        return [
            Finding(
                expected=spans[row].subtask,
                seen=spans[row].subtask,
                after=spans[row - 1] if row else None,
                frame=spans[row].start,
                missing=False,
                surprise=float(losses[row]),
                ineffective=spans[row],
            )
            for row in np.flatnonzero(losses > 0).tolist()
        ]


def _seen(span: Span) -> bool:
    return not isinstance(span, Supposed)
