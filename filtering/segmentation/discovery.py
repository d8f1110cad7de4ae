"""Which sub-tasks the videos of a pool have in common, how many, and where: no label is read.

Many videos show the same few things, mostly once each, in different orders. So the parts of one
video (TW-FINCH) are a first model of all: every video is segmented with it, its segments are
matched one-to-one to the sub-tasks, the sub-tasks are averaged anew over all videos, and so on
(hard EM). The start that explains the pool best wins. The number of sub-tasks is that beyond which
one more explains next to nothing: log(unexplained variance) + SMALLEST_GAIN * T is least.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.segmentation.stage_model import (
    NOWHERE,
    StageModel,
    States,
    Videos,
    best_states,
    one_to_one,
    probabilities,
)
from filtering.segmentation.twfinch import partition
from teasim.pool.types import runs

Array = NDArray[np.float64]

MOST_SUBTASKS = 12
"""Most that are looked for when nobody says how many there are."""
MOST_STAGES = 10
"""Most stages of a sub-task; videos of few moments have fewer, so that MOST_SUBTASKS fit in."""
SMALLEST_GAIN = 0.035
"""Share of the unexplained variance that a further sub-task has to explain."""
PATIENCE = 3
"""So many numbers of sub-tasks in a row without gain end the search."""
STARTS = 4
"""Starts that are followed to the end, the best of all at first sight."""
SPARE_PARTS = (0, 2)
"""Parts a video is cut into beyond the sub-tasks; the longest are taken for a start."""
ROUNDS = 12
"""Most times the model is averaged anew."""
TINY = 1e-12
"""Variance of videos in which nothing happens [variance of a feature]."""


@dataclass(frozen=True)
class Discovery:
    """The sub-tasks of a pool, in the usual order of their first occurrence."""

    labels: tuple[NDArray[np.int64], ...]
    """Per video (n,): sub-task of each moment, 0..T-1."""
    posteriors: tuple[Array, ...]
    """Per video (n, T): how probable each sub-task is at each moment."""


@dataclass(frozen=True)
class _Fit:
    """A model and how it explains the videos."""

    model: StageModel
    errors: Array
    """(D, n, T, L) squared distances."""
    states: States
    """(D, n), those of least error."""
    error: float
    """Their sum."""

    def cost(self) -> float:
        """Return log(unexplained variance) + SMALLEST_GAIN * T; the least is best."""
        moments = int((self.states != NOWHERE).sum())
        T, L, features = self.model.means.shape
        variance = self.error / (features * max(moments - T * L, 1))
        return float(np.log(variance + TINY) + SMALLEST_GAIN * T)


def discover(videos: Sequence[Array], subtasks: int | None = None) -> Discovery:
    """Find the sub-tasks of a pool.

    Args:
        videos: per video (n, F) features, each feature's mean over the video taken out.
        subtasks: how many to look for; None to find that out. Those that no video turns out to
            show are left out.
    """
    stages = stage_count([len(video) for video in videos], subtasks)
    kept = [_stretched(len(video), stages) for video in videos]
    stacked = Videos.of([video[rows] for video, rows in zip(videos, kept, strict=True)])
    fit = _best_fit(stacked, subtasks, stages) if subtasks else _best_number(stacked, stages)
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
    """Return L, so many stages that the usual video has room for all sub-tasks.

    Args:
        lengths: moments of each video.
        subtasks: how many are looked for, if that is known.
    """
    room = int(np.median(lengths)) // max(subtasks or 0, MOST_SUBTASKS)
    return min(max(room, 1), MOST_STAGES)


def most_subtasks(lengths: NDArray[np.int64], stages: int) -> int:
    """Return how many sub-tasks videos of these moments can tell about, 1..MOST_SUBTASKS."""
    return int(np.clip(lengths.sum() // (2 * stages), 1, min(lengths.max(), MOST_SUBTASKS)))


def _stretched(length: int, least: int) -> NDArray[np.int64]:
    """Return the moments of a video, some of them more than once where it has too few."""
    return np.arange(length) if length >= least else np.arange(least) * length // least


def _best_number(videos: Videos, stages: int) -> _Fit:
    """Return the fit whose number of sub-tasks costs least, of 1, 2, ..."""
    best = _best_fit(videos, 1, stages)
    for subtasks in range(2, most_subtasks(videos.lengths, stages) + 1):
        fit = _best_fit(videos, subtasks, stages)
        best = min(best, fit, key=_Fit.cost)
        if subtasks - len(best.model.means) >= PATIENCE:
            break
    return best


def _best_fit(videos: Videos, subtasks: int, stages: int) -> _Fit:
    """Follow the best starts and return the fit of least error."""
    starts = [_fit(videos, model) for model in _starts(videos, subtasks, stages)]
    starts.sort(key=lambda fit: fit.error)
    return min((_refined(videos, fit) for fit in starts[:STARTS]), key=lambda fit: fit.error)


def _starts(videos: Videos, subtasks: int, stages: int) -> Iterator[StageModel]:
    """Yield the longest parts of every video as sub-tasks, where it has that many."""
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
    """Return what a unit of error costs, so that features and moments that agree count once.

    Errors of different features and of neighbouring moments are much alike. So the squared distance
    is scaled to as many features as vary on their own, (sum of the eigenvalues)^2 / sum of their
    squares for the errors' covariance, and divided by the moments for which an error lasts,
    (1 + r) / (1 - r) at an autocorrelation r from one moment to the next.
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
