"""A parametric null: the losses that honest demonstrations of a pool would have.

Occurrence of each step and a normal position (Thurstone's model of an order) are fitted to the
trusted demonstrations; demonstrations are drawn from them and scored against the same trusted ones.
"""

import numpy as np

from filtering.judging.decision.columns import PRECEDENCE_NORM, PRECEDENCE_WORST, SMOOTHING
from filtering.judging.decision.observed import Observed
from filtering.judging.norm.steps import StepCounts
from teasim.common.arrays import Array

DRAWS = 100
"""Number of demonstrations drawn; their quantiles are wanted to about a tenth."""


def null_losses(pool: Observed, counts: StepCounts, trust: Array) -> Array:
    """Return the losses of DRAWS honest demonstrations [nats].

    Args:
        pool: D demonstrations in canonical form.
        counts: their counts.
        trust: (D,) how much each is trusted, in [0, 1].
    """
    rng = np.random.default_rng(0)
    weight = np.where(trust > 0.2, trust, 0.0)
    mean, spread = _places(pool, weight, counts.n_subtasks)
    chance = (weight @ counts.occurs + SMOOTHING) / (weight.sum() + 2 * SMOOTHING)
    occurs = rng.random((DRAWS, len(chance))) < chance
    place = mean + spread * rng.normal(size=occurs.shape)
    both = occurs[:, :, None] & occurs[:, None, :]
    after = both & (place[:, :, None] > place[:, None, :])
    usual = np.maximum(np.log(chance / (1 - chance)), 0)
    order = np.maximum(_order(counts, weight), 0)
    broken = (after * order).reshape(DRAWS, -1)
    precedence = PRECEDENCE_NORM * np.linalg.norm(broken, axis=1)
    precedence += PRECEDENCE_WORST * broken.max(axis=1)
    return np.asarray(((1 - occurs) * usual).sum(axis=1) + precedence)


def _order(counts: StepCounts, weight: Array) -> Array:
    """Return (T, T): log-odds that the step of the row comes before that of the column."""
    known = counts.both * weight[:, None, None]
    yes = (counts.before * known).sum(axis=0)
    return np.asarray(np.log((yes + SMOOTHING) / (known.sum(axis=0) - yes + SMOOTHING)))


def _places(pool: Observed, weight: Array, n_labels: int) -> tuple[Array, Array]:
    """Return (T,) mean and (T,) standard deviation of the relative position of each label."""
    total, first, second = np.full(n_labels, 1e-9), np.zeros(n_labels), np.zeros(n_labels)
    for demo, w in zip(pool.steps, weight, strict=True):
        labels = np.array(demo.labels)
        number = np.bincount(labels, minlength=n_labels)
        relative = (np.arange(len(labels)) + 0.5) / len(labels)
        place = np.bincount(labels, relative, n_labels) / np.maximum(number, 1)
        own = w * (number > 0)
        total, first, second = total + own, first + own * place, second + own * place**2
    mean = first / total
    variance = np.maximum(second / total - mean**2, 0) * (total + 1) / total
    return mean, np.sqrt(variance)


def above_null(null: Array, losses: Array) -> dict[str, Array]:
    """Compare losses (D,) with those of honest demonstrations."""
    most = np.quantile(null, 0.9 ** (1 / len(losses)))
    return {
        "null.z": (losses - null.mean()) / (null.std() + 0.5),
        "null.above": losses - most,
        "null.share": (null[None] >= losses[:, None]).mean(axis=1),
        "null.mean": np.full(len(losses), null.mean()),
        "null.spread": np.full(len(losses), null.std()),
    }
