"""Simple scores of step lists with which the filter is compared; none of them reads labels.

Each takes the demonstrations of a pool and returns their losses (D,), higher is worse. Where step
probabilities are fitted, every demonstration is scored by those of the others.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from sklearn.covariance import LedoitWolf
from sklearn.neighbors import NearestNeighbors

from filtering.judging.norm.steps import StepList, count_steps
from filtering.segmentation.metrics import levenshtein
from teasim.common.arrays import Array

SMOOTHING = 0.5
"""Pseudo-count of every event [demonstrations]."""
NEIGHBOURS = 0.25
"""Share of the pool that counts as neighbours; incorrect demonstrations have to be fewer."""

Baseline = Callable[[Sequence[StepList]], Array]
"""Takes the demonstrations of a pool; returns their losses (D,)."""


def length(demos: Sequence[StepList]) -> Array:
    """Return minus the number of frames: short demonstrations are worse."""
    return np.array([-float(sum(demo.lengths)) for demo in demos])


def segments(demos: Sequence[StepList]) -> Array:
    """Return minus the number of segments: demonstrations of few segments are worse."""
    return np.array([-float(len(demo.labels)) for demo in demos])


def bigram(demos: Sequence[StepList]) -> Array:
    """Return the mean negative log-likelihood of the next step given the last [nats per step]."""
    follows = count_steps(demos, _n_subtasks(demos)).follows
    others = follows.sum(axis=0) - follows + SMOOTHING
    surprise = -np.log(others / others.sum(axis=2, keepdims=True))
    return np.asarray((follows * surprise).sum(axis=(1, 2)) / follows.sum(axis=(1, 2)))


def bernoulli(demos: Sequence[StepList]) -> Array:
    """Return the negative log-likelihood of independent steps and bigrams [nats]."""
    counts = count_steps(demos, _n_subtasks(demos))
    bigrams = np.minimum(counts.follows.reshape(len(demos), -1), 1.0)
    present = np.hstack([counts.occurs, bigrams[:, bigrams.any(axis=0)]])
    others = present.sum(axis=0) - present
    p = (others + SMOOTHING) / (len(demos) - 1 + 2 * SMOOTHING)
    return np.asarray(-(present * np.log(p) + (1 - present) * np.log(1 - p)).sum(axis=1))


def edit_distance(demos: Sequence[StepList]) -> Array:
    """Return the edit distance to the medoid as a share of the longer step list."""
    distances = np.array(
        [
            [
                levenshtein(one.labels, other.labels) / max(len(one.labels), len(other.labels))
                for other in demos
            ]
            for one in demos
        ]
    )
    # The mean over equally central ones, so that the order of the pool has no effect.
    total = distances.sum(axis=1)
    return np.asarray(distances[:, total <= total.min() + 1e-9].mean(axis=1))


def nearest(demos: Sequence[StepList]) -> Array:
    """Return the mean distance to the nearest quarter of the pool in occurrence and duration."""
    features = _features(demos)
    count = max(1, round(NEIGHBOURS * len(demos)))
    model = NearestNeighbors(n_neighbors=min(count, len(demos) - 1)).fit(features)
    distances, _ = model.kneighbors()
    return np.asarray(distances.mean(axis=1))


def mahalanobis(demos: Sequence[StepList]) -> Array:
    """Return the squared Mahalanobis distance to the mean, with the Ledoit-Wolf covariance."""
    features = _features(demos)
    if np.allclose(features, features[0]):
        return np.zeros(len(demos))
    return np.asarray(LedoitWolf().fit(features).mahalanobis(features))


def chance(demos: Sequence[StepList]) -> Array:
    """Return random losses, the same for every pool of that size."""
    return np.random.default_rng(0).random(len(demos))


BASELINES: Mapping[str, Baseline] = MappingProxyType(
    {
        "length": length,
        "segments": segments,
        "bigram": bigram,
        "bernoulli": bernoulli,
        "edit": edit_distance,
        "nearest": nearest,
        "mahalanobis": mahalanobis,
        "random": chance,
    }
)
"""Every baseline by name."""


def _n_subtasks(demos: Sequence[StepList]) -> int:
    return 1 + max(max(demo.labels) for demo in demos)


def _features(demos: Sequence[StepList]) -> Array:
    """Return (D, 2 T): occurrence and share of the time of each sub-task."""
    occurs = count_steps(demos, _n_subtasks(demos)).occurs
    shares = np.zeros_like(occurs)
    for row, demo in enumerate(demos):
        np.add.at(shares[row], list(demo.labels), demo.lengths)
    return np.hstack([occurs, shares / shares.sum(axis=1, keepdims=True)])
