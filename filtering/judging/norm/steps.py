"""Counts of step lists: occurrence, precedence and next steps.

They are what the default score is computed from; nothing is fitted here.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teasim.common.arrays import Array
from teasim.pool.types import runs


@dataclass(frozen=True)
class StepList:
    """One demonstration as a list of segments."""

    labels: tuple[int, ...]
    """(q,) sub-task of each segment, 0..T-1."""
    lengths: tuple[int, ...]
    """(q,) frames of each segment; a short, possibly spurious segment has little influence."""

    def __post_init__(self) -> None:
        if len(self.labels) != len(self.lengths):
            raise ValueError("labels and lengths differ in number")
        if any(length < 1 for length in self.lengths):
            raise ValueError("a segment has no frames")


def steps_of_frames(labels: NDArray[np.int64]) -> StepList:
    """Return the runs of equal labels (n,); negative labels are background and are skipped.

    Raises:
        ValueError: every frame is background.
    """
    kept = labels[labels >= 0]
    if not len(kept):
        raise ValueError("every frame is background")
    found = runs(kept)
    return StepList(tuple(run.label for run in found), tuple(run.length for run in found))


@dataclass(frozen=True)
class StepCounts:
    """The counts of D demonstrations over T sub-tasks; START and END are label T of bigrams."""

    occurs: Array
    """(D, T) x_da: 1 where a sub-task occurs."""
    before: Array
    """(D, T, T) q_dab, share of the pairs of an a-frame and a b-frame in which a is first; 0 where
    the demonstration lacks one of them."""
    both: Array
    """(D, T, T) 1 where a and b both occur and differ."""
    follows: Array
    """(D, T + 1, T + 1) B_dst, how often t follows s directly."""

    @property
    def n_demos(self) -> int:
        """D."""
        return len(self.occurs)

    @property
    def n_subtasks(self) -> int:
        """T."""
        return self.occurs.shape[1]


def count_steps(demos: Sequence[StepList], n_subtasks: int) -> StepCounts:
    """Count occurrence, precedence and next steps of D demonstrations.

    Args:
        demos: D step lists.
        n_subtasks: T, number of labels that may occur.
    """
    shape = (len(demos), n_subtasks, n_subtasks)
    owners = np.repeat(np.arange(len(demos)), [len(demo.labels) for demo in demos])
    labels = np.array([label for demo in demos for label in demo.labels], dtype=np.int64)
    lengths = np.array([length for demo in demos for length in demo.lengths], dtype=np.float64)
    occurs = np.zeros(shape[:2])
    occurs[owners, labels] = 1.0
    both = occurs[:, :, None] * occurs[:, None, :] * (1 - np.eye(n_subtasks))
    before = _precedence(owners, labels, lengths, shape[:2])
    follows = _transitions(demos, n_subtasks)
    return StepCounts(occurs, before * both, both, follows)


def _precedence(
    owners: NDArray[np.int64], labels: NDArray[np.int64], lengths: Array, shape: tuple[int, int]
) -> Array:
    """Return (D, T, T): share of frame pairs with the sub-task of the row before the column."""
    frames = np.zeros((len(labels), shape[1]))
    frames[np.arange(len(labels)), labels] = lengths
    total = np.zeros(shape)
    np.add.at(total, (owners, labels), lengths)
    # Frames of each sub-task before a segment: those of the pool minus those of earlier demos.
    earlier = np.cumsum(frames, axis=0) - frames - (np.cumsum(total, axis=0) - total)[owners]
    pairs = np.zeros((*shape, shape[1]))
    np.add.at(pairs.transpose(0, 2, 1), (owners, labels), earlier * lengths[:, None])
    possible = total[:, :, None] * total[:, None, :]
    return np.divide(pairs, possible, out=np.zeros_like(pairs), where=possible > 0)


def _transitions(demos: Sequence[StepList], n_subtasks: int) -> Array:
    """Return (D, T + 1, T + 1): how often the sub-task of the column follows that of the row."""
    follows = np.zeros((len(demos), n_subtasks + 1, n_subtasks + 1))
    owners = np.repeat(np.arange(len(demos)), [len(demo.labels) + 1 for demo in demos])
    sources = np.array([label for demo in demos for label in (n_subtasks, *demo.labels)])
    targets = np.array([label for demo in demos for label in (*demo.labels, n_subtasks)])
    np.add.at(follows, (owners, sources, targets), 1.0)
    return follows
