"""A hidden Markov model of the sub-tasks, shared by all videos of a pool.

A sub-task is a sequence of L stages, each with a mean feature (a left-to-right model, as in Kuehne
et al., WACV 2016); any sub-task may follow any other. All sub-tasks share the first stage, because
they begin with the hands where the previous one left them; so a sub-task cannot begin within
another one without cost.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from teasim.common.arrays import Array

States = NDArray[np.int64]
"""(D, n) sub-task * L + stage of each sampled frame, or NOWHERE."""

NOWHERE = -1
"""State of frames after the end of a video, or of a segment of no sub-task."""
SHRINKAGE = 0.5
"""Pseudo-count of frames at zero, the mean of every video, in the mean of a stage."""


@dataclass(frozen=True)
class Videos:
    """The videos of a pool, padded to equal length."""

    moments: Array
    """(D, n, F) features, each video's own mean taken out."""
    lengths: NDArray[np.int64]
    """(D,) moments of each video."""

    @classmethod
    def of(cls, videos: Sequence[Array]) -> Self:
        """Stack videos (n, F) of different lengths."""
        lengths = np.array([len(video) for video in videos])
        moments = np.zeros((len(videos), lengths.max(), videos[0].shape[1]))
        for filled, video in zip(moments, videos, strict=True):
            filled[: len(video)] = video
        return cls(moments, lengths)


@dataclass(frozen=True)
class StageModel:
    """T sub-tasks of L stages."""

    means: Array
    """(T, L, F) mean feature of each stage."""

    @classmethod
    def from_parts(cls, video: Array, parts: Sequence[tuple[int, int]], stages: int) -> Self:
        """Make every part `start <= frame < stop` of a video (n, F) a sub-task."""
        means = np.array([_stage_means(video[start:stop], stages) for start, stop in parts])
        means[:, 0] = means[:, 0].mean(axis=0)
        return cls(means)

    @classmethod
    def from_states(cls, videos: Videos, states: States, shape: tuple[int, int]) -> Self:
        """Average the moments of each state; `shape` is (T, L)."""
        seen = states != NOWHERE
        members = states[seen] == np.arange(shape[0] * shape[1])[:, None]
        counts = members.sum(axis=1).reshape(shape)
        sums = (members.astype(float) @ videos.moments[seen]).reshape(*shape, -1)
        counts[:, 0], sums[:, 0] = counts[:, 0].sum(), sums[:, 0].sum(axis=0)
        return cls(sums / (counts + SHRINKAGE)[..., None])

    def errors(self, videos: Videos) -> Array:
        """Return the squared distance of each moment to each stage, (D, n, T, L)."""
        flat = self.means.reshape(-1, self.means.shape[-1])
        squares = (videos.moments**2).sum(axis=-1)
        errors = squares[..., None] - 2.0 * videos.moments @ flat.T + (flat**2).sum(axis=1)
        return np.maximum(errors, 0.0).reshape(*squares.shape, *self.means.shape[:2])


def best_states(errors: Array, lengths: NDArray[np.int64]) -> tuple[States, float]:
    """Return the states of least summed error and that sum (Viterbi).

    Every video begins with the first stage of a sub-task and ends with the last one of a sub-task;
    from frame to frame a stage continues or the next one begins.

    Args:
        errors: (D, n, T, L).
        lengths: (D,) moments of each video, L or more.
    """
    D, n, _, L = errors.shape
    totals = np.full((n, *errors.shape[:1], *errors.shape[2:]), np.inf)
    totals[0, :, :, 0] = errors[:, 0, :, 0]
    moved = np.zeros(totals.shape, dtype=bool)
    left = np.zeros((n, D), dtype=np.int64)
    for moment in range(1, n):
        before = totals[moment - 1]
        left[moment] = before[:, :, -1].argmin(axis=1)
        entered = _entered(before, before[:, :, -1].min(axis=1))
        moved[moment] = entered < before
        totals[moment] = np.minimum(entered, before) + errors[:, moment]
    videos = np.arange(D)
    ends = totals[lengths - 1, videos, :, -1]
    labels, stages = ends.argmin(axis=1), np.full(D, L - 1)
    states = np.full((D, n), NOWHERE)
    for moment in reversed(range(n)):
        inside = moment < lengths
        states[inside, moment] = (labels * L + stages)[inside]
        back = moved[moment, videos, labels, stages] & inside
        first = back & (stages == 0)
        labels = np.where(first, left[moment], labels)
        stages = np.where(first, L - 1, stages - back)
    return states, float(ends.min(axis=1).sum())


def one_to_one(errors: Array, states: States) -> States:
    """Assign different sub-tasks to the segments of each video at least error (Hungarian method).

    During learning this keeps two sub-tasks from becoming one that occurs twice. Segments beyond
    the number of sub-tasks get the state NOWHERE. `errors` (D, n, T, L) are those of `states`.
    """
    L = errors.shape[3]
    matched = np.full_like(states, NOWHERE)
    for result, video, path in zip(matched, errors, states, strict=True):
        path = path[path != NOWHERE]
        starts = segment_starts(path, L)
        stops = np.append(starts[1:], len(path))
        at_stage = video[np.arange(len(path)), :, path % L]  # (n, T)
        costs = np.add.reduceat(at_stage, starts, axis=0)
        for segment, label in zip(*linear_sum_assignment(costs - costs.max()), strict=True):
            span = slice(starts[segment], stops[segment])
            result[span] = label * L + path[span] % L
    return matched


def segment_starts(path: NDArray[np.int64], stages: int) -> NDArray[np.int64]:
    """Return where segments begin in the states (n,) of a video of sub-tasks of L `stages`."""
    label, stage = np.diff(path // stages), np.diff(path % stages)
    return np.append(0, 1 + np.flatnonzero((label != 0) | (stage < 0)))


def probabilities(nats: Array) -> Array:
    """Return the probability of each sub-task at each frame of a video, (n, T), rows sum to 1.

    It sums over all paths that `best_states` chooses from (forward-backward algorithm).

    Args:
        nats: (n, T, L) negative log-likelihood of each stage at each moment.
    """
    forward, backward = np.full(nats.shape, -np.inf), np.full(nats.shape, -np.inf)
    forward[0, :, 0] = -nats[0, :, 0]
    for moment in range(1, len(nats)):
        before = forward[moment - 1]
        entered = _entered(before[None], np.logaddexp.reduce(before[:, -1], keepdims=True))[0]
        forward[moment] = np.logaddexp(before, entered) - nats[moment]
    backward[-1, :, -1] = 0.0
    for moment in reversed(range(len(nats) - 1)):
        after = backward[moment + 1] - nats[moment + 1]
        onward = np.full(after.shape, np.logaddexp.reduce(after[:, 0]))
        onward[:, :-1] = after[:, 1:]
        backward[moment] = np.logaddexp(after, onward)
    logs = np.logaddexp.reduce(forward + backward, axis=2)
    result: Array = np.exp(logs - np.logaddexp.reduce(logs, axis=1, keepdims=True))
    return result


def _entered(before: Array, left: Array) -> Array:
    """Return values (D, T, L) of coming from the stage before; the first one comes from `left`."""
    entered = np.empty_like(before)
    entered[:, :, 0] = left[:, None]
    entered[:, :, 1:] = before[:, :, :-1]
    return entered


def _stage_means(part: Array, stages: int) -> Array:
    """Return the means (L, F) of equal shares of a part (n, F); shares may overlap by a moment."""
    edges = np.linspace(0, len(part), stages + 1)
    shares = zip(edges[:-1].astype(int), np.ceil(edges[1:]).astype(int), strict=True)
    return np.array([part[start:stop].mean(axis=0) for start, stop in shares])
