"""Two populations in a pool, and which of them is the norm: the heavier one.

A mixture of two Bernoulli models over what a demonstration does at all, what comes before what, and
which steps follow each other; fitted by expectation maximisation from many seeded starts. Head
count decides: the population of the greater responsibility is the norm, whichever of the two is
easier to fit. A trimmed fit alone prefers the easier one, also when it is the minority.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from filtering.judging.norm.steps import Array, StepCounts

STARTS = 20
"""Random starts; the likeliest end counts."""
ITERATIONS = 60
"""Steps of expectation maximisation per start."""
SMOOTHING = 0.5
"""Pseudo-count on both sides of every probability [demonstrations]."""
BIGRAM_WEIGHT = 0.15
"""How much a bigram counts beside an occurrence; segmenters make spurious ones."""
FEWEST_BIGRAMS = 2
"""A bigram of fewer demonstrations tells nothing about the pool."""


@dataclass(frozen=True)
class Populations:
    """The two populations of a pool."""

    norm: Array
    """(D,) responsibility of the heavier population."""
    log_ratio: Array
    """(D,) log p(d | other) - log p(d | norm) [nats], larger is less like the norm."""
    occurrence: Array
    """(2, T) probability that a sub-task occurs: in the norm, in the other."""

    @property
    def lacking(self) -> Array:
        """(T,) how much rarer each sub-task is in the other population [probability]."""
        return np.asarray(np.maximum(self.occurrence[0] - self.occurrence[1], 0))

    @property
    def lack(self) -> float:
        """How many steps more the other population leaves out, in expectation."""
        return float(self.lacking.sum())


def find_populations(counts: StepCounts, seed: int = 0) -> Populations:
    """Split a pool of two demonstrations or more; `seed` draws the starts."""
    values, known, weights = _features(counts)
    rng = np.random.default_rng(seed)
    # Starts are drawn in an order of content, so that the order of the pool does not matter.
    ranks = np.argsort(np.lexsort(np.hstack([values, known]).T))
    ends = [_climb(values, known * weights, rng.random(len(values))[ranks]) for _ in range(STARTS)]
    share, probabilities, log_ratio, _ = max(ends, key=lambda end: end[3])
    if share.sum() < len(share) / 2:
        share, probabilities, log_ratio = 1 - share, probabilities[::-1], -log_ratio
    return Populations(share, log_ratio, probabilities[:, : counts.n_subtasks])


def _features(counts: StepCounts) -> tuple[Array, Array, Array]:
    """Return (D, F) values in [0, 1], (D, F) 1 where they are known, (F,) their weights."""
    demos, tasks = counts.occurs.shape
    first, second = np.triu_indices(tasks, 1)
    pairs, known = counts.before[:, first, second], counts.both[:, first, second]
    bigrams = np.minimum(counts.follows.reshape(demos, -1), 1.0)
    bigrams = bigrams[:, bigrams.sum(axis=0) >= FEWEST_BIGRAMS]
    values = np.hstack([counts.occurs, pairs, bigrams])
    is_known = np.hstack([np.ones_like(counts.occurs), known, np.ones_like(bigrams)])
    weights = np.concatenate(
        [
            np.ones(tasks),
            np.full(pairs.shape[1], 1 / max(tasks - 1, 1)),
            np.full(bigrams.shape[1], BIGRAM_WEIGHT),
        ]
    )
    return values, is_known, weights


def _climb(
    values: Array, weights: Array, share: NDArray[np.float64]
) -> tuple[Array, Array, Array, float]:
    """Run EM; return responsibilities (D,), probabilities (2, F), log-ratio (D,), likelihood."""
    present, absent = weights * values, weights * (1 - values)
    known = np.maximum(weights.max(axis=0), 1e-12)
    for _ in range(ITERATIONS):
        shares = np.stack([share, 1 - share])
        mixing = (shares.sum(axis=1) + SMOOTHING) / (len(share) + 2 * SMOOTHING)
        yes, no = shares @ present, shares @ absent
        probabilities = (yes / known + SMOOTHING) / ((yes + no) / known + 2 * SMOOTHING)
        log_p = present @ np.log(probabilities).T + absent @ np.log(1 - probabilities).T
        log_joint = log_p + np.log(mixing)
        updated = expit(log_joint[:, 0] - log_joint[:, 1])
        done = np.abs(updated - share).max() < 1e-6
        share = updated
        if done:
            break
    likelihood = float(np.logaddexp(log_joint[:, 0], log_joint[:, 1]).sum())
    return share, probabilities, log_p[:, 1] - log_p[:, 0], likelihood
