"""Discovery of the sub-tasks that the videos of a pool share; no label is read.

Many videos show the same few sub-tasks, mostly once each, in different orders. The parts of one
video (TW-FINCH) initialise the model; then every video is segmented with it, its segments are
matched one-to-one to the sub-tasks, and the sub-tasks are averaged over all videos, until nothing
changes (hard EM). Of several starts, the one that explains the pool best is kept. The number T of
sub-tasks minimises log(unexplained variance) + SMALLEST_GAIN * T.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.segmentation.unlabelled.stage_model import (
    NOWHERE,
    StageModel,
    States,
    Videos,
    best_states,
    one_to_one,
    probabilities,
)
from filtering.segmentation.unlabelled.twfinch import partition
from teasim.common import parallel
from teasim.common.arrays import Array
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool.types import runs

MOST_SUBTASKS = 12
"""Largest number of sub-tasks that is tried when it is inferred."""
MOST_STAGES = 10
"""Largest number of stages of a sub-task; short videos have fewer, so that MOST_SUBTASKS fit."""
SMALLEST_GAIN = 0.035
"""Share of the unexplained variance that a further sub-task has to explain. Chosen on rendered tea
pools, see docs/results.md."""
PATIENCE = 3
"""Number of consecutive values of T without gain after which the search ends."""
STARTS = 4
"""Number of starts that are refined: those of least error after one step."""
SPARE_PARTS = (0, 2)
"""Parts into which a video is cut beyond T; the T longest parts make a start."""
ROUNDS = 12
"""Largest number of iterations of a refinement."""
WORTH_WORKERS = 3000
"""Moments of a pool from which numbers of sub-tasks are tried in several processes; with fewer it
takes longer to start them."""
TINY = 1e-12
"""Variance added before the logarithm, for videos without change [variance of a feature]."""


@dataclass(frozen=True)
class Discovery:
    """The sub-tasks of a pool, in the usual order of their first occurrence."""

    labels: tuple[NDArray[np.int64], ...]
    """Per video (n,): sub-task at each sampled frame, 0..T-1."""
    posteriors: tuple[Array, ...]
    """Per video (n, T): probability of each sub-task at each sampled frame."""


@dataclass(frozen=True)
class _Fit:
    """A model with its fit to the videos."""

    model: StageModel
    """The sub-tasks."""
    errors: Array
    """(D, n, T, L) squared distances."""
    states: States
    """(D, n) states of least error."""
    error: float
    """Sum of the errors of these states."""

    def cost(self) -> float:
        """Return log(unexplained variance) + SMALLEST_GAIN * T; the least is best."""
        moments = int((self.states != NOWHERE).sum())
        T, L, features = self.model.means.shape
        variance = self.error / (features * max(moments - T * L, 1))
        return float(np.log(variance + TINY) + SMALLEST_GAIN * T)


def discover(
    videos: Sequence[Array], subtasks: int | None = None, *, workers: Workers = IN_PROCESS
) -> Discovery:
    """Find the sub-tasks of a pool.

    Args:
        videos: per video (n, F) features, each feature's mean over the video taken out.
        subtasks: their number; None infers it. Sub-tasks that no video shows are dropped.
        workers: where numbers of sub-tasks are tried; the result does not depend on it.
    """
    stages = stage_count([len(video) for video in videos], subtasks)
    kept = [_stretched(len(video), stages) for video in videos]
    stacked = Videos.of([video[rows] for video, rows in zip(videos, kept, strict=True)])
    if subtasks:
        fit = _best_fit(stacked, stages, subtasks)
    else:
        fit = _best_number(stacked, stages, workers)
    order = _usual_order(fit.states // stages, stacked.lengths)
    rank = np.full(len(fit.model.means), len(order))
    rank[order] = np.arange(len(order))
    nats = fit.errors[:, :, order] * _nats_per_error(stacked, fit)
    labels, posteriors = [], []
    for video, (moments, rows) in enumerate(zip(videos, kept, strict=True)):
        back = np.searchsorted(rows, np.arange(len(moments)))
        labels.append(rank[fit.states[video, back] // stages])
        posteriors.append(probabilities(nats[video, : len(rows)])[back])
    return Discovery(tuple(labels), tuple(posteriors))


def stage_count(lengths: Sequence[int], subtasks: int | None = None) -> int:
    """Return L, the number of stages at which a video of median length can hold all sub-tasks.

    Args:
        lengths: moments of each video.
        subtasks: number of sub-tasks, if it is given.
    """
    fitting = int(np.median(lengths)) // max(subtasks or 0, MOST_SUBTASKS)
    return min(max(fitting, 1), MOST_STAGES)


def most_subtasks(lengths: NDArray[np.int64], stages: int) -> int:
    """Return the largest number of sub-tasks that videos of these lengths support."""
    return int(np.clip(lengths.sum() // (2 * stages), 1, min(lengths.max(), MOST_SUBTASKS)))


def _stretched(length: int, least: int) -> NDArray[np.int64]:
    """Return the sampled frames of a video; some are repeated if there are fewer than `least`."""
    return np.arange(length) if length >= least else np.arange(least) * length // least


def _best_number(videos: Videos, stages: int, workers: Workers) -> _Fit:
    """Return the fit of least cost over the numbers of sub-tasks 1, 2, ..."""
    best = _best_fit(videos, stages, 1)
    for subtasks, fit in _fits(videos, stages, workers):
        best = min(best, fit, key=_Fit.cost)
        if subtasks - len(best.model.means) >= PATIENCE:
            break
    return best


def _fits(videos: Videos, stages: int, workers: Workers) -> Iterator[tuple[int, _Fit]]:
    """Yield the best fits of 2, 3, ... sub-tasks; every worker tries one number at a time."""
    used = workers if videos.lengths.sum() >= WORTH_WORKERS else IN_PROCESS
    trial = partial(_best_fit, videos, stages)
    numbers = range(2, most_subtasks(videos.lengths, stages) + 1)
    for first in range(0, len(numbers), used.count):
        some = numbers[first : first + used.count]
        yield from zip(some, parallel.run(trial, some, workers=used, progress=False), strict=True)


def _best_fit(videos: Videos, stages: int, subtasks: int) -> _Fit:
    """Refine the best starts and return the fit of least error."""
    with threadpool_limits(limits=1, user_api="blas"):  # sums get one order in every process
        starts = [_fit(videos, model) for model in _starts(videos, subtasks, stages)]
        starts.sort(key=lambda fit: fit.error)
        return min((_refined(videos, fit) for fit in starts[:STARTS]), key=lambda fit: fit.error)


def _starts(videos: Videos, subtasks: int, stages: int) -> Iterator[StageModel]:
    """Yield a start from the longest parts of every video that has enough of them."""
    for moments, length in zip(videos.moments, videos.lengths, strict=True):
        video = moments[:length]
        for spare in SPARE_PARTS:
            parts = sorted(runs(partition(video, subtasks + spare)), key=lambda run: -run.length)
            if len(parts) >= subtasks:
                spans = [(part.start, part.stop) for part in parts[:subtasks]]
                yield StageModel.from_parts(video, spans, stages)


def _refined(videos: Videos, fit: _Fit) -> _Fit:
    for _ in range(ROUNDS):
        matched = one_to_one(fit.errors, fit.states)
        refined = _fit(videos, StageModel.from_states(videos, matched, fit.model.means.shape[:2]))
        if np.array_equal(refined.states, fit.states):
            break
        fit = refined
    return fit


def _fit(videos: Videos, model: StageModel) -> _Fit:
    errors = model.errors(videos)
    return _Fit(model, errors, *best_states(errors, videos.lengths))


def _usual_order(labels: NDArray[np.int64], lengths: NDArray[np.int64]) -> list[int]:
    """Return the labels that occur, by their mean place of first occurrence in labels (D, n)."""
    places: dict[int, list[float]] = {}
    for video, length in zip(labels, lengths, strict=True):
        found, first = np.unique(video[:length], return_index=True)
        for label, place in zip(found.tolist(), first / length, strict=True):
            places.setdefault(label, []).append(place)
    return sorted(places, key=lambda label: (np.mean(places[label]), label))


def _nats_per_error(videos: Videos, fit: _Fit) -> float:
    """Return the nats per unit of error, corrected for correlated features and frames.

    Errors of different features and of neighbouring frames are correlated. The squared distance is
    scaled to the effective number of features, (sum of the eigenvalues)^2 / sum of their squares
    for the covariance of the errors, and divided by the correlation time of the errors,
    (1 + r) / (1 - r) at an autocorrelation r between neighbouring frames.
    """
    flat = fit.model.means.reshape(-1, fit.model.means.shape[-1])
    left = np.where((fit.states == NOWHERE)[..., None], 0.0, videos.moments - flat[fit.states])
    rows = left[fit.states != NOWHERE]
    power = (rows**2).sum()
    if power <= TINY * rows.size:
        return 0.0
    covariance = rows.T @ rows / len(rows)
    features = np.trace(covariance) ** 2 / (covariance**2).sum()
    likeness = np.clip((left[:, 1:] * left[:, :-1]).sum() / power, 0.0, 0.99)
    lasting = (1.0 + likeness) / (1.0 - likeness)
    return float(features / lasting * len(rows) / (2.0 * power))
