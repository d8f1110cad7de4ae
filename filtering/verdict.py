"""From a score to weights and groups: the two ways of judging a pool, behind one form.

* `norm`, the default: the losses of `norm_score`. The cut lies two thirds of the way from the mean
  of the lower to the mean of the upper cluster of sqrt(l), and never below SMALLEST_CUT: what costs
  less than that is variety. Below it nothing is flagged, which is how a clean pool stays clean.
* `equation3`: the paper's conditional next-step model, trimmed, and k-means on its weights.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from filtering.thresholds import Grouping, group_weights
from filtering.weights.norm_score import near_and_far, score_steps
from filtering.weights.score import Score
from filtering.weights.steps import Array, StepCounts
from teasim.errors import ConfigError

SMALLEST_CUT = 2.0
"""Losses up to this are never flagged on their own [nats]."""
CUT_SHARE = 2 / 3
"""Where between the two clusters' means of sqrt(l) the cut lies."""


@dataclass(frozen=True)
class Verdict:
    """What is to be thought of the demonstrations of a pool."""

    losses: Array
    """(D,) surprise [nats], higher is worse."""
    weights: Array
    """(D,) in [0, 1], 1 for a usual demonstration."""
    grouping: Grouping
    """Groups and threshold on the weights."""


Judge = Callable[[StepCounts, Score, str], Verdict]


def by_norm(counts: StepCounts, surprises: Score, groups: str) -> Verdict:  # noqa: ARG001
    """Judge by what most of the pool does (the default score)."""
    losses = score_steps(counts).losses
    cut = cut_of(losses)
    weights = 1 / (1 + (losses / cut) ** 2)  # one half at the cut
    if groups != "auto":
        return Verdict(losses, weights, group_weights(weights, groups))
    flagged = losses > cut
    return Verdict(losses, weights, Grouping(flagged.astype(np.int64), 0.5 * flagged.any()))


def by_equation_3(counts: StepCounts, surprises: Score, groups: str) -> Verdict:  # noqa: ARG001
    """Judge by the surprises of equation 3."""
    return Verdict(surprises.losses, surprises.weights, group_weights(surprises.weights, groups))


def cut_of(losses: NDArray[np.float64]) -> float:
    """Loss above which a demonstration is flagged [nats], for losses (D,)."""
    low, high = near_and_far(losses)
    if not len(high):
        return SMALLEST_CUT
    between = low.mean() + CUT_SHARE * (high.mean() - low.mean())
    return max(float(between) ** 2, SMALLEST_CUT)


JUDGES: Mapping[str, Judge] = MappingProxyType({"norm": by_norm, "equation3": by_equation_3})
"""Every way of judging by name."""


def judge_named(name: str) -> Judge:
    """Return a way of judging.

    Raises:
        ConfigError: there is none of that name.
    """
    if name not in JUDGES:
        raise ConfigError(f"Unknown score '{name}'; choose {', '.join(JUDGES)}.")
    return JUDGES[name]
