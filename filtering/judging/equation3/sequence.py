"""Segments to (state, next sub-task) rows with START and END (paper section 3.3).

A demonstration of q segments gives q + 1 rows. Row 0 is the state before anything was done (START)
and asks for the first sub-task; row k is the state after segment k and asks for the sub-task that
follows; the last row asks for END. Predicting the *next* label makes an omission visible: with the
label of the segment itself as the target, an omitted step leaves no trace.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

HISTORY_SCALE = 1.0
"""Length of a finished sub-task's entry in the history block [relative to a segment's feature].

At 1 the ridge penalises both equally: the view decides, and history decides where views are alike
(turning the oven on and off)."""


@dataclass(frozen=True)
class Transitions:
    """The rows of a pool, demonstration after demonstration."""

    states: NDArray[np.float64]
    """(R, N) state features of each row."""
    nexts: NDArray[np.int64]
    """(R,) sub-task that follows, 0..T-1, or T for END."""
    demos: NDArray[np.int64]
    """(R,) demonstration of each row, 0..D-1, not decreasing."""
    n_demos: int
    """D, number of demonstrations."""
    n_subtasks: int
    """T, number of sub-task labels without END."""

    def __post_init__(self) -> None:
        rows = len(self.states)
        if len(self.nexts) != rows or len(self.demos) != rows:
            raise ValueError("states, nexts and demos differ in length")
        for array in (self.states, self.nexts, self.demos):
            array.setflags(write=False)


def done_so_far(labels: Sequence[int], n_subtasks: int) -> NDArray[np.float64]:
    """Return (q + 1, T): row k is 1 where a sub-task occurs among the first k segments."""
    done = np.zeros((len(labels) + 1, n_subtasks))
    for position, label in enumerate(labels):
        done[position + 1] = done[position]
        done[position + 1, label] = 1.0
    return done


def next_labels(labels: Sequence[int], n_subtasks: int) -> NDArray[np.int64]:
    """Return (q + 1,): the first sub-task, the one after each segment, and END (= T)."""
    return np.array([*labels, n_subtasks], dtype=np.int64)


def state_rows(
    features: NDArray[np.float64], labels: Sequence[int], n_subtasks: int
) -> NDArray[np.float64]:
    """Return (q + 1, 2 + N + T): bias, START, current segment's features, history.

    The history block says which sub-tasks are done. It separates "tea bag after milk because it was
    not in yet" (another order) from "oven off after milk although no tea bag is in" (an omission).
    No block depends on the label that is to be predicted.
    """
    history = HISTORY_SCALE * done_so_far(labels, n_subtasks)
    start = np.zeros((len(labels) + 1, 1))
    start[0] = 1.0
    current = np.vstack([np.zeros((1, features.shape[1])), features])
    return np.hstack([np.ones_like(start), start, current, history])


def transitions(
    features: Sequence[NDArray[np.float64]], labels: Sequence[Sequence[int]], n_subtasks: int
) -> Transitions:
    """Stack all demonstrations of a pool.

    Args:
        features: per demonstration (q, N), one row per segment.
        labels: per demonstration its q sub-task labels, 0..T-1.
        n_subtasks: T.
    """
    pairs = list(zip(features, labels, strict=True))
    return Transitions(
        states=np.vstack([state_rows(values, names, n_subtasks) for values, names in pairs]),
        nexts=np.concatenate([next_labels(names, n_subtasks) for _, names in pairs]),
        demos=np.repeat(np.arange(len(pairs)), [len(names) + 1 for _, names in pairs]),
        n_demos=len(pairs),
        n_subtasks=n_subtasks,
    )
