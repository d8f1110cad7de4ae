"""Two populations in a pool; the one of greater responsibility is the norm.

A mixture of two Bernoulli models over occurrence, precedence and next steps, fitted by expectation
maximisation from many seeded starts. The majority defines the norm, whichever population is easier
to fit; a trimmed fit alone prefers the easier one, even if it is the minority.

The weights of the blocks were chosen on the data sets named in `norm_score`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from filtering.judging.norm.steps import StepCounts
from teasim.common.arrays import Array

STARTS = 20
"""Random starts; the result of greatest likelihood is used."""
ITERATIONS = 60
"""Steps of expectation maximisation per start."""
SMOOTHING = 0.5
"""Pseudo-count on both sides of every probability [demonstrations]."""
BIGRAM_WEIGHT = 0.15
"""Weight of a bigram relative to an occurrence; segmenters produce spurious ones."""
FEWEST_BIGRAMS = 2
"""Bigrams of fewer demonstrations are not used."""


@dataclass(frozen=True)
class Populations:
    """The two populations of a pool."""

    norm: Array
    """(D,) responsibility of the heavier population."""
    log_ratio: Array
    """(D,) log p(d | other) - log p(d | norm) [nats]; larger is less like the norm."""
    occurrence: Array
    """(2, T) probability that a sub-task occurs, in the norm and in the other population."""

    @property
    def lacking(self) -> Array:
        """(T,) how much less probable each sub-task is in the other population."""
        return np.asarray(np.maximum(self.occurrence[0] - self.occurrence[1], 0))

    @property
    def lack(self) -> float:
        """Expected number of steps that the other population omits in addition."""
        return float(self.lacking.sum())


def find_populations(counts: StepCounts, seed: int = 0) -> Populations:
    """Split a pool of two or more demonstrations; `seed` is that of the starts."""
    values, known, weights = _features(counts)
    rng = np.random.default_rng(seed)
    # Starts are drawn in the order of content, so that the order of the pool has no effect.
    ranks = np.argsort(np.lexsort(np.hstack([values, known]).T))
    starts = np.stack([rng.random(len(values))[ranks] for _ in range(STARTS)])
    share, probabilities, log_ratio = _climb(values, known * weights, starts)
    if share.sum() < len(share) / 2:
        share, probabilities, log_ratio = 1 - share, probabilities[::-1], -log_ratio
    return Populations(share, log_ratio, probabilities[:, : counts.n_subtasks])


def _features(counts: StepCounts) -> tuple[Array, Array, Array]:
    """Return values (D, F) in [0, 1], a mask (D, F) of known ones, and their weights (F,)."""
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


def _climb(values: Array, weights: Array, share: Array) -> tuple[Array, Array, Array]:
    """Run EM from all starts (S, D) at once and use the end of greatest likelihood.

    Returns:
        Its responsibility (D,), probabilities (2, F) and log-ratio (D,).
    """
    present, absent = weights * values, weights * (1 - values)
    known = np.maximum(weights.max(axis=0), 1e-12)
    starts, demos = share.shape
    for _ in range(ITERATIONS):
        shares = np.concatenate([share, 1 - share])
        mixing = (shares.sum(axis=1) + SMOOTHING) / (demos + 2 * SMOOTHING)
        yes, no = shares @ present, shares @ absent
        probabilities = (yes / known + SMOOTHING) / ((yes + no) / known + 2 * SMOOTHING)
        log_p = np.log(probabilities) @ present.T + np.log1p(-probabilities) @ absent.T
        log_joint = log_p + np.log(mixing)[:, None]
        updated = expit(log_joint[:starts] - log_joint[starts:])
        done = np.abs(updated - share).max() < 1e-6
        share = updated
        if done:
            break
    best = int(np.logaddexp(log_joint[:starts], log_joint[starts:]).sum(axis=1).argmax())
    own = [best, starts + best]
    return share[best], probabilities[own], log_p[own[1]] - log_p[own[0]]
