"""The default score: how far a demonstration is from what most of the pool does, in nats.

Three blocks instead of equation 3's one, because one does not do it all: what is omitted, what is
out of order, and the worst next step. All are excesses over the commonest, so that a usual
demonstration costs about nothing at any length, and each demonstration is scored by the others.

    z_a   = log (sum w x + a) / (sum w (1 - x) + a)                     occurrence log-odds
    z_ab  = log (sum w q + a) / (sum w (1 - q) + a)                     precedence log-odds
    OM_d  = sum_a (1 - x_da) max(0, z_a)                                omitted steps
    v_dab = max(0, z_ab) (1 - q_dab)                                    violated precedence
    PR_d  = 1/4 |v_d| + 1/2 max v_d                                     one displaced step breaks
                                                                        many pairs: never their sum
    AD_d  = max over transitions (log max_u pi_u|s - log pi_t|s)        the worst transition
    l_d   = OM_d + PR_d + 0.2 AD_d

The sums run over the other demonstrations, weighted by how much each is trusted. Trust comes from
`mixture` first, then from the losses themselves: trimmed to half of the pool, then refitted to all
that are near to that half.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import expit

from filtering.judging.kmeans import clusters
from filtering.judging.norm.mixture import find_populations
from filtering.judging.norm.steps import Array, StepCounts

SMOOTHING = 0.5
"""Pseudo-count on both sides of every log-odds [demonstrations]."""
PRECEDENCE_NORM, PRECEDENCE_WORST = 0.25, 0.5
"""How much all violated pairs and the worst of them count."""
TRANSITION = 0.2
"""How much the worst transition counts."""
SYSTEMATIC = 0.4
"""How much it counts to be of the other population when that leaves out more than a step."""
LARGEST_RATIO = 20.0
"""Most that the population says about one demonstration [nats]."""


@dataclass(frozen=True)
class NormScore:
    """The score of a pool of D demonstrations over T sub-tasks."""

    losses: Array
    """(D,) l_d [nats], higher is worse."""
    trust: Array
    """(D,) w: how much each demonstration shapes the norm, in [0, 1]."""
    usual: Array
    """(D, T) max(0, z_a): what leaving a sub-task out would add [nats]."""
    omitted: Array
    """(D, T) what each left-out sub-task adds [nats]."""
    misplaced: Array
    """(D, T, T) v_dab: strength of the norm that a comes before b, where it is violated [nats]."""
    precedence: Array
    """(D,) PR_d: what all violated pairs add [nats]."""
    transition: Array
    """(D,) AD_d: the worst transition [nats]; it counts TRANSITION times."""
    worst_step: NDArray[np.int64]
    """(D, 3) the worst transition: from, to, and where most go; T is START, or END."""
    systematic: Array
    """(D,) what it adds to be of the other population [nats]."""
    lack: Array
    """(T,) how much rarer each sub-task is in the other population [probability]."""

    @property
    def left_out(self) -> Array:
        """(D,) what steps that are not there add [nats]."""
        return np.asarray(self.omitted.sum(axis=1) + self.systematic)

    @property
    def out_of_order(self) -> Array:
        """(D,) what the order of the steps adds [nats]."""
        return np.asarray(self.precedence + TRANSITION * self.transition)


def score_steps(
    counts: StepCounts, seed: int = 0, tolerance: float = 0.0, n_groups: int = 2
) -> NormScore:
    """Score the demonstrations of a pool.

    Args:
        counts: what they do.
        seed: draws the starts of the mixture.
        tolerance: b in [0, 1): w becomes (1 - b) w + b, so that what a minority does is less of a
            surprise; about 0.2 spares legal orders that a few share.
        n_groups: clusters of sqrt(l) for the refit, 2 or 3; the lowest is trusted.
    """
    populations = find_populations(counts, seed)
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
    order = np.maximum(_log_odds(counts.before, counts.both, trust), 0) * counts.binding
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
    """Return (D, ...): log-odds of a share in [0, 1] among the other demonstrations."""
    weight = trust.reshape(-1, *[1] * (share.ndim - 1))
    yes, no = weight * share * known, weight * (1 - share) * known
    return np.asarray(
        np.log((yes.sum(axis=0) - yes + SMOOTHING) / (no.sum(axis=0) - no + SMOOTHING))
    )


def _worst_transition(follows: Array, trust: Array) -> tuple[Array, NDArray[np.int64]]:
    """Return (D,) its excess, (D, 3) from, to, and where most others go."""
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
    """Trust half of the pool, smoothly: w = sigmoid((nu - l) / tau) with sum w = D / 2."""
    tau = 0.5 * (0.5 * float(losses.std()) + 0.05)
    half = len(losses) / 2
    low, high = losses.min() - 40 * tau, losses.max() + 40 * tau
    centre = brentq(lambda nu: float(expit((nu - losses) / tau).sum()) - half, low, high)
    return np.asarray(expit((centre - losses) / tau))


def _refit(losses: Array, trimmed: Array, count: int) -> Array:
    """Trust all that are near to the better half: the lowest of the clusters of sqrt(l)."""
    roots = np.sqrt(losses)
    low, *higher = clusters(roots, count)
    if not higher:
        return trimmed
    middle = (low.mean() + higher[0].mean()) / 2
    residuals = np.concatenate([c - c.mean() for c in (low, *higher)])
    spread = max(0.5 * float(residuals.std()), 1e-3)
    trust = np.asarray(expit((middle - roots) / spread))
    return trust if trust.sum() >= len(losses) / count else trimmed
