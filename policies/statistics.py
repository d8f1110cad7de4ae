"""Rates with honest intervals: Wilson's, widened when trials come in correlated groups."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

Z_95 = 1.959963984540054
"""Two-sided 95 % quantile of the standard normal distribution."""


@dataclass(frozen=True)
class Rate:
    """A share of trials with its 95 % interval; no trials at all: nan within [0, 1]."""

    hits: int
    trials: int
    low: float
    high: float

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
    """Rate of independent trials."""
    return Rate(hits, trials, *wilson_interval(hits, trials))


def grouped_rate(groups: Sequence[tuple[int, int]]) -> Rate:
    """Rate of (hits, trials) per group, where trials within a group are alike.

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
