"""The risk of leaving out a step: what the pool shows of it, and what the user says of it.

The paper names as a limitation that all sub-tasks count alike. A step that trusted
demonstrations never leave out is riskier to leave out than one that some of them do without.
"""

from collections.abc import Collection, Sequence

import numpy as np

from filtering.judging.norm.norm_score import SMOOTHING
from filtering.judging.rules.rules import CRITICAL_RISK
from teasim.common.arrays import Array

DIGITS = 2
"""Decimal places to which risks are told."""


def learned_risks(occurs: Array, weights: Array) -> Array:
    """Return the risk (T,) of leaving out each step, in [0, 1).

    Let z be the log-odds that a demonstration does the step, each counted by its weight. The risk
    is tanh(z / 2), the share of those who do it minus that of those who do not, and 0 where fewer
    than half do it. z is about what leaving the step out adds to the loss of the score norm, so the
    loss, and with it the probability, already holds this risk.

    Args:
        occurs: (D, T) 1 where a sub-task occurs.
        weights: (D,) weight of each demonstration.
    """
    yes, no = weights @ occurs + SMOOTHING, weights @ (1 - occurs) + SMOOTHING
    return np.asarray(np.maximum((yes - no) / (yes + no), 0.0))


def risks_of(
    subtasks: Sequence[str], learned: Array, critical: Collection[int], optional: Collection[int]
) -> dict[str, float]:
    """Return the risk of each step by name: at least CRITICAL_RISK if critical, 0 if optional."""
    risks = learned.copy()
    risks[list(critical)] = np.maximum(risks[list(critical)], CRITICAL_RISK)
    risks[list(optional)] = 0.0
    return dict(zip(subtasks, risks.tolist(), strict=True))


def words_about_risks(risks: dict[str, float], told: Collection[str]) -> str:
    """Return a sentence with the risks, the largest first; `told` are those of the user."""
    alike: dict[str, list[str]] = {}
    for name, risk in sorted(risks.items(), key=lambda item: -round(item[1], DIGITS)):
        mark = " (as told)" * (name in told)
        alike.setdefault(f"{risk:.{DIGITS}f}", []).append(name + mark)
    steps = "; ".join(f"{risk} {', '.join(names)}" for risk, names in alike.items())
    return f"Risk of leaving out a step: {steps}."
