"""Rates and differences with 95 % intervals, which are wider for correlated groups of trials."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Z_95 = 1.959963984540054
"""Two-sided 95 % quantile of the standard normal distribution."""


RESAMPLES = 10_000
"""Bootstrap samples for the interval of a difference."""


@dataclass(frozen=True)
class Rate:
    """A share of trials with its 95 % interval; without trials nan within [0, 1]."""

    hits: int
    """Trials that count."""
    trials: int
    """All trials."""
    low: float
    """Lower end of the interval, in [0, 1]."""
    high: float
    """Upper end of the interval, in [0, 1]."""

    @property
    def value(self) -> float:
        """Observed share in [0, 1], nan without trials."""
        return self.hits / self.trials if self.trials else math.nan

    def __str__(self) -> str:
        """Write the rate in percent, for example '85.7 % (60.1-96.0)'."""
        if not self.trials:
            return "no trials"
        return f"{100 * self.value:.1f} % ({100 * self.low:.1f}-{100 * self.high:.1f})"


def wilson_interval(hits: float, trials: float, z: float = Z_95) -> tuple[float, float]:
    """Score interval of a binomial share (Wilson 1927); (0, 1) when `trials` is 0.

    >>> low, high = wilson_interval(9, 10)
    >>> f"{low:.3f} to {high:.3f}"
    '0.596 to 0.982'

    Raises:
        ValueError: unless 0 <= hits <= trials.
    """
    if not 0 <= hits <= trials:
        raise ValueError(f"{hits} hits in {trials} trials is not a share")
    if trials == 0:
        return 0.0, 1.0
    share = hits / trials
    centre = share + z * z / (2 * trials)
    spread = z * math.sqrt(share * (1 - share) / trials + z * z / (4 * trials * trials))
    scale = 1 + z * z / trials
    # At the ends the exact bound is 0 or 1; subtraction would leave a rounding error instead.
    low = 0.0 if hits == 0 else (centre - spread) / scale
    high = 1.0 if hits == trials else (centre + spread) / scale
    return low, high


def rate(hits: int, trials: int) -> Rate:
    """Rate of independent trials.

    >>> str(rate(12, 14))
    '85.7 % (60.1-96.0)'
    """
    return Rate(hits, trials, *wilson_interval(hits, trials))


def grouped_rate(groups: Sequence[tuple[int, int]]) -> Rate:
    """Rate of (hits, trials) per group, where trials within a group are correlated.

    The actions of one episode are such a group: a policy that is stuck repeats its error. Wilson's
    interval is taken at the effective number of trials, trials / max(1, design effect), where the
    design effect is the variance of the ratio between groups over the binomial variance
    (Kish 1965, section 5.4).
    """
    hits = sum(h for h, _ in groups)
    trials = sum(n for _, n in groups)
    effective = trials / _design_effect(groups, hits, trials)
    share = hits / trials if trials else 0.0
    # hits == trials must stay exact, or the upper bound would miss 1 by a rounding error.
    at = effective if hits == trials else share * effective
    return Rate(hits, trials, *wilson_interval(at, effective))


def widest(rates: Sequence[Rate]) -> Rate:
    """Return the same rate with an interval that covers those of all `rates`."""
    first = rates[0]
    return Rate(first.hits, first.trials, min(r.low for r in rates), max(r.high for r in rates))


def _design_effect(groups: Sequence[tuple[int, int]], hits: int, trials: int) -> float:
    count = sum(1 for _, n in groups if n)
    if trials == 0:
        return 1.0
    if count == 1:
        return float(trials)  # one group says nothing about the spread between groups
    share = hits / trials
    binomial = share * (1 - share) / trials
    if binomial == 0:
        return 1.0
    between = sum((h - share * n) ** 2 for h, n in groups) / trials**2 * count / (count - 1)
    return max(1.0, between / binomial)


@dataclass(frozen=True)
class Difference:
    """A difference of two shares, in [-1, 1], with its 95 % interval."""

    value: float
    """Observed difference."""
    low: float
    """Lower end of the interval."""
    high: float
    """Upper end of the interval."""

    def __str__(self) -> str:
        """Write the difference in points, for example '+12.0 points (+3.1 to +20.5)'."""
        value, low, high = (100 * bound for bound in (self.value, self.low, self.high))
        return f"{value:+.1f} points ({low:+.1f} to {high:+.1f})"


def bootstrap_difference(
    first: Sequence[tuple[int, int]], second: Sequence[tuple[int, int]], seed: int = 0
) -> Difference:
    """Share of hits of `first` minus that of `second`, both (hits, trials) per paired group.

    The interval comes from drawing pairs of groups with replacement (percentile bootstrap; Efron &
    Tibshirani 1993, chapter 13). A share without a trial counts as 0.

    Raises:
        ValueError: there is no pair, or not as many groups in both.
    """
    if len(first) != len(second) or not first:
        raise ValueError(f"{len(first)} and {len(second)} groups make no pairs")
    counts = np.array([first, second], dtype=np.int64)  # (2, n, 2)
    n = len(first)
    drawn = np.random.default_rng(seed).multinomial(n, np.full(n, 1 / n), RESAMPLES)
    low, high = np.quantile(_gaps(np.einsum("rn,pnc->rpc", drawn, counts)), [0.025, 0.975])
    return Difference(float(_gaps(counts.sum(axis=1)[None])[0]), float(low), float(high))


def _gaps(sums: NDArray[np.int64]) -> NDArray[np.float64]:
    """Difference (r,) of the shares in sums (r, 2, 2) of (hits, trials) of first and second."""
    shares = sums[..., 0] / np.maximum(sums[..., 1], 1)
    gaps: NDArray[np.float64] = shares[:, 0] - shares[:, 1]
    return gaps


def mcnemar(only_first: int, only_second: int) -> float:
    """Two-sided exact p value of McNemar's test from the counts of discordant pairs."""
    n, fewer = only_first + only_second, min(only_first, only_second)
    tail = sum(math.comb(n, k) for k in range(fewer + 1)) / 2**n
    return min(1.0, 2 * tail)


def auroc(values: Sequence[float] | np.ndarray, positive: Sequence[bool] | np.ndarray) -> float:
    """Share of pairs in which a positive has the larger value (n,); ties count half.

    Raises:
        ValueError: there are no positives or no negatives.
    """
    numbers, marks = np.asarray(values, dtype=float), np.asarray(positive, dtype=bool)
    if marks.all() or not marks.any():
        raise ValueError("An AUROC needs positives and negatives.")
    differences = numbers[marks][:, None] - numbers[~marks][None, :]
    return float((np.sign(differences).mean() + 1) / 2)
