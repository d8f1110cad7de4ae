"""What a claim about the filter must beat: simple scores of step lists, none told what is wrong.

Each takes the demonstrations of a pool and returns their losses (D,), higher is worse. Where step
probabilities are fitted, every demonstration is scored by those of the others.
"""

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from sklearn.covariance import LedoitWolf
from sklearn.neighbors import NearestNeighbors

from filtering.judging.norm.steps import Array, StepList, count_steps

SMOOTHING = 0.5
"""Pseudo-count of every event [demonstrations]."""
NEIGHBOURS = 0.25
"""Share of the pool that counts as neighbours; the incorrect ones have to be fewer than that."""

Baseline = Callable[[Sequence[StepList]], Array]


def length(demos: Sequence[StepList]) -> Array:
    """Call short demonstrations bad: minus the number of frames."""
    return np.array([-float(sum(demo.lengths)) for demo in demos])


def segments(demos: Sequence[StepList]) -> Array:
    """Call demonstrations of few segments bad: minus their number."""
    return np.array([-float(len(demo.labels)) for demo in demos])


def bigram(demos: Sequence[StepList]) -> Array:
    """Mean negative log-likelihood of the next step given the last [nats per step]."""
    follows = count_steps(demos, _n_subtasks(demos)).follows
    others = follows.sum(axis=0) - follows + SMOOTHING
    surprise = -np.log(others / others.sum(axis=2, keepdims=True))
    return np.asarray((follows * surprise).sum(axis=(1, 2)) / follows.sum(axis=(1, 2)))


def bernoulli(demos: Sequence[StepList]) -> Array:
    """Negative log-likelihood of which steps and which bigrams occur, independently [nats]."""
    counts = count_steps(demos, _n_subtasks(demos))
    bigrams = np.minimum(counts.follows.reshape(len(demos), -1), 1.0)
    present = np.hstack([counts.occurs, bigrams[:, bigrams.any(axis=0)]])
    others = present.sum(axis=0) - present
    p = (others + SMOOTHING) / (len(demos) - 1 + 2 * SMOOTHING)
    return np.asarray(-(present * np.log(p) + (1 - present) * np.log(1 - p)).sum(axis=1))


def edit_distance(demos: Sequence[StepList]) -> Array:
    """Edit distance to the medoid, as a share of the longer step list."""
    distances = np.array(
        [[_distance(one.labels, other.labels) for other in demos] for one in demos]
    )
    # Of equally central ones their mean counts, so that the order of the pool does not matter.
    total = distances.sum(axis=1)
    return np.asarray(distances[:, total <= total.min() + 1e-9].mean(axis=1))


def nearest(demos: Sequence[StepList]) -> Array:
    """Mean distance to the nearest quarter of the pool, by what is done and for how long."""
    features = _features(demos)
    count = max(1, round(NEIGHBOURS * len(demos)))
    model = NearestNeighbors(n_neighbors=min(count, len(demos) - 1)).fit(features)
    distances, _ = model.kneighbors()
    return np.asarray(distances.mean(axis=1))


def mahalanobis(demos: Sequence[StepList]) -> Array:
    """Squared Mahalanobis distance to the mean, with Ledoit and Wolf's covariance."""
    features = _features(demos)
    if np.allclose(features, features[0]):
        return np.zeros(len(demos))
    return np.asarray(LedoitWolf().fit(features).mahalanobis(features))


def chance(demos: Sequence[StepList]) -> Array:
    """Draw the losses; the same numbers for every pool of that size."""
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


def _features(demos: Sequence[StepList]) -> NDArray[np.float64]:
    """Return (D, 2 T): what occurs, and its share of the time."""
    occurs = count_steps(demos, _n_subtasks(demos)).occurs
    shares = np.zeros_like(occurs)
    for row, demo in enumerate(demos):
        np.add.at(shares[row], list(demo.labels), demo.lengths)
    return np.hstack([occurs, shares / shares.sum(axis=1, keepdims=True)])


def _distance(one: Sequence[int], other: Sequence[int]) -> float:
    """Return Levenshtein's distance of two step lists over the length of the longer, 0 to 1."""
    above = np.arange(len(other) + 1)
    steps = np.array(other)
    for place, label in enumerate(one, start=1):
        changed = np.concatenate(
            [[place], np.minimum(above[1:] + 1, above[:-1] + (steps != label))]
        )
        # An insertion adds one to the left neighbour: a running minimum after taking that off.
        offsets = np.arange(len(changed))
        above = np.minimum.accumulate(changed - offsets) + offsets
    return float(above[-1] / max(len(one), len(other)))
