"""The default score: how far a demonstration is from what most of the pool does, in nats.

Three blocks replace the single one of equation 3: omitted steps, steps out of order, and the worst
next step. Each is an excess over the most common behaviour, so the loss of a usual demonstration is
near 0 at any length. Each demonstration is scored by the others.

    z_a   = log (sum w x + a) / (sum w (1 - x) + a)                     occurrence log-odds
    z_ab  = log (sum w q + a) / (sum w (1 - q) + a)                     precedence log-odds
    OM_d  = sum_a (1 - x_da) max(0, z_a)                                omitted steps
    v_dab = max(0, z_ab) (1 - q_dab)                                    violated precedence
    PR_d  = 1/4 |v_d| + 1/2 max v_d                                     not a sum: one displaced
                                                                        step violates many pairs
    AD_d  = max over transitions (log max_u pi_u|s - log pi_t|s)        the worst transition
    l_d   = OM_d + PR_d + 0.2 AD_d

The sums run over the other demonstrations, weighted by their trust. Trust comes from `mixture`
first, then from the losses themselves: trimmed to half of the pool, then refitted to all
demonstrations that are near to that half.

Structure and constants were chosen on CaptainCook4D (8 recipes), predicted segments of 50 Salads
and the UNH tea videos, and checked on recipes that were not used for the choice (CaptainCook4D and
chemistry procedures).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from filtering.judging.kmeans import clusters
from filtering.judging.norm.mixture import Populations, find_populations
from filtering.judging.norm.steps import StepCounts
from teasim.common.arrays import Array
from teasim.common.trimming import soft_trim

SMOOTHING = 0.5
"""Pseudo-count on both sides of every log-odds [demonstrations]. The data sets above are hardly
sensitive to it."""
PRECEDENCE_NORM, PRECEDENCE_WORST = 0.25, 0.5
"""Factors of the norm of all violated pairs and of the worst one. Chosen on the data sets above."""
TRANSITION = 0.2
"""Factor of the worst transition; small, because segmenters produce false transitions. Chosen on
the data sets above."""
SYSTEMATIC = 0.4
"""Factor of the log-ratio of the two populations, where the other one omits more than one step.
Chosen on the data sets above."""
LARGEST_RATIO = 20.0
"""Largest log-ratio of the populations that counts [nats]. Chosen on the data sets above."""
TRUSTED_SHARE = 0.5
"""Share of the pool that the trimming trusts: the smallest majority. On tea pools of ten Seq_1 and
eight Seq_2, a share of three quarters flagged almost
none of the Seq_2."""
TRIM_SOFTNESS, TRIM_FLOOR = 0.25, 0.025
"""Temperature of the trimming: factor of the standard deviation of the losses, and constant [nats].
Chosen on the data sets above."""
REFIT_SOFTNESS = 0.5
"""Softness of the refit [standard deviation of sqrt(loss) within the clusters]. Chosen on the data
sets above."""
REFIT_FLOOR = 1e-3
"""Least softness of the refit [sqrt(nats)]; avoids a division by 0 for equal losses."""


@dataclass(frozen=True)
class NormScore:
    """The score of a pool of D demonstrations over T sub-tasks."""

    losses: Array
    """(D,) l_d [nats], higher is worse."""
    trust: Array
    """(D,) w in [0, 1], how much each demonstration shapes the norm."""
    usual: Array
    """(D, T) max(0, z_a), what omitting a sub-task would add [nats]."""
    omitted: Array
    """(D, T) what each omitted sub-task adds [nats]."""
    misplaced: Array
    """(D, T, T) v_dab, strength of the norm that a comes before b where it is violated [nats]."""
    precedence: Array
    """(D,) PR_d, what all violated pairs add [nats]."""
    transition: Array
    """(D,) AD_d, excess of the worst transition [nats]; it adds TRANSITION times this."""
    worst_step: NDArray[np.int64]
    """(D, 3) labels of the worst transition: from, to, and the usual target; T is START or END."""
    systematic: Array
    """(D,) what membership in the other population adds [nats]."""
    lack: Array
    """(T,) how much less probable each sub-task is in the other population."""

    @property
    def left_out(self) -> Array:
        """(D,) what omissions add [nats]."""
        return np.asarray(self.omitted.sum(axis=1) + self.systematic)

    @property
    def out_of_order(self) -> Array:
        """(D,) what the order of the steps adds [nats]."""
        return np.asarray(self.precedence + TRANSITION * self.transition)


def score_steps(
    counts: StepCounts, seed: int = 0, tolerance: float = 0.0, n_groups: int = 2
) -> NormScore:
    """Return the score of a pool.

    Args:
        counts: occurrence, precedence and next steps of the demonstrations.
        seed: seed of the starts of the mixture.
        tolerance: b in [0, 1): w becomes (1 - b) w + b, so that the behaviour of a minority
            surprises less; at about 0.2, legal orders that a few share are not flagged.
        n_groups: clusters of sqrt(loss) for the refit, 2 or 3; the lowest is trusted.
    """
    return score_populations(
        counts, find_populations(counts, seed), tolerance=tolerance, n_groups=n_groups
    )


def score_populations(
    counts: StepCounts, populations: Populations, tolerance: float = 0.0, n_groups: int = 2
) -> NormScore:
    """Return the score of a pool whose two populations are known; see `score_steps`."""
    first = _score(counts, populations.norm)
    trimmed = _trim(first.losses)
    second = _score(counts, trimmed)
    trust = (1 - tolerance) * _refit(second.losses, trimmed, n_groups) + tolerance
    final = _score(counts, trust)
    systematic = np.clip(populations.lack - 1, 0, 1) * np.clip(
        populations.log_ratio, 0, LARGEST_RATIO
    )
    return replace(
        final,
        losses=final.losses + SYSTEMATIC * systematic,
        systematic=SYSTEMATIC * systematic,
        lack=populations.lacking,
    )


def _score(counts: StepCounts, trust: Array) -> NormScore:
    usual = np.maximum(_log_odds(counts.occurs, 1.0, trust), 0)
    omitted = (1 - counts.occurs) * usual
    order = np.maximum(_log_odds(counts.before, counts.both, trust), 0)
    misplaced = order * (1 - counts.before) * counts.both
    broken = misplaced.reshape(counts.n_demos, -1)
    worst = broken.max(axis=1, initial=0.0)
    precedence = PRECEDENCE_NORM * np.linalg.norm(broken, axis=1) + PRECEDENCE_WORST * worst
    transition, worst_step = _worst_transition(counts.follows, trust)
    return NormScore(
        losses=omitted.sum(axis=1) + precedence + TRANSITION * transition,
        trust=trust,
        usual=usual,
        omitted=omitted,
        misplaced=misplaced,
        precedence=precedence,
        transition=transition,
        worst_step=worst_step,
        systematic=np.zeros(counts.n_demos),
        lack=np.zeros(counts.n_subtasks),
    )


def _log_odds(share: Array, known: Array | float, trust: Array) -> Array:
    """Return (D, ...): log-odds of `share` (D, ...) in [0, 1] among the other demonstrations."""
    weight = trust.reshape(-1, *[1] * (share.ndim - 1))
    yes, no = weight * share * known, weight * (1 - share) * known
    return np.asarray(
        np.log((yes.sum(axis=0) - yes + SMOOTHING) / (no.sum(axis=0) - no + SMOOTHING))
    )


def _worst_transition(follows: Array, trust: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return its excess (D,), and its from, to and usual target (D, 3)."""
    weighted = trust[:, None, None] * follows
    others = weighted.sum(axis=0) - weighted + SMOOTHING
    excess = np.log(others.max(axis=2, keepdims=True) / others)
    flat = np.where(follows > 0, excess, 0.0).reshape(len(follows), -1)
    worst = flat.argmax(axis=1)
    everyone = np.arange(len(follows))
    source, target = np.divmod(worst, follows.shape[2])
    usual = others[everyone, source].argmax(axis=1)
    return flat[everyone, worst], np.stack([source, target, usual], axis=1)


def _trim(losses: Array) -> Array:
    """Return trust (D,) of sum TRUSTED_SHARE * D, near 1 for the least losses."""
    temperature = TRIM_SOFTNESS * float(losses.std()) + TRIM_FLOOR
    return soft_trim(losses, np.ones(len(losses)), TRUSTED_SHARE * len(losses), temperature)


def _refit(losses: Array, trimmed: Array, count: int) -> Array:
    """Return trust (D,) near 1 for the lowest of `count` clusters of sqrt(loss)."""
    roots = np.sqrt(losses)
    low, *higher = clusters(roots, count)
    if not higher:
        return trimmed
    middle = (low.mean() + higher[0].mean()) / 2
    residuals = np.concatenate([c - c.mean() for c in (low, *higher)])
    spread = max(REFIT_SOFTNESS * float(residuals.std()), REFIT_FLOOR)
    trust = np.asarray(expit((middle - roots) / spread))
    return trust if trust.sum() >= len(losses) / count else trimmed
