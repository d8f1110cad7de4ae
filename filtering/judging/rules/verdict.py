"""What broken rules do to a judgement: probabilities, weights, groups and reasons."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from filtering.judging.explain import Finding
from filtering.judging.judgement import Judgement
from filtering.judging.norm.cut import NATURES
from filtering.judging.rules.rules import Charge
from filtering.judging.thresholds import Grouping, probability_incorrect
from teasim.common.arrays import Array

BREAKS = "breaks a rule"
"""Group of those who break a rule of order."""


def ruled(judged: Judgement, charges: Sequence[Sequence[Charge]]) -> Judgement:
    """Return the judgement after the rules of the user; the same where nobody breaks one.

    A demonstration with the probability p that breaks a rule of risk r is correct only if neither
    speaks against it: p becomes 1 - (1 - p) (1 - r), and its weight is multiplied by 1 - r. The
    risk is 1 for a rule of order.

    Args:
        judged: by what the pool shows.
        charges: per demonstration the rules that it breaks.
    """
    p = judged.probabilities
    p = probability_incorrect(judged.losses) if p is None else p
    left = np.array([np.prod([1 - charge.risk for charge in own]) for own in charges])
    if (left == 1).all():
        return replace(judged, probabilities=p)
    raised = 1 - (1 - p) * left
    weights = judged.weights * left
    added = [sum(charge.finding.surprise for charge in own) for own in charges]
    decision = judged.decision
    return replace(
        judged,
        losses=judged.losses + np.array(added),
        probabilities=raised,
        weights=weights,
        grouping=_regrouped(judged.grouping, weights, charges),
        findings=tuple(
            _with_charges(found, own) for found, own in zip(judged.findings, charges, strict=True)
        ),
        decision=None if decision is None else replace(decision, probabilities=raised),
    )


def _regrouped(grouping: Grouping, weights: Array, charges: Sequence[Sequence[Charge]]) -> Grouping:
    """Flag those whose rules took their weight below the threshold."""
    accused: NDArray[np.bool_] = np.array([bool(own) for own in charges])
    threshold = grouping.threshold or min(0.5, weights[~accused].min(initial=1.0))
    flagged = accused & (weights < threshold)
    if not grouping.names and grouping.count > 1:  # groups that only weights define
        groups = np.where(flagged, np.maximum(grouping.groups, 1), grouping.groups)
        return Grouping(groups, threshold)
    names = list(grouping.names or NATURES[:1])
    named = [names[group] for group in grouping.groups.tolist()]
    for demo in np.flatnonzero(flagged).tolist():
        named[demo] = NATURES[2] if charges[demo][0].finding.missing else BREAKS
    order = [name for name in (*NATURES, BREAKS) if name in (NATURES[0], *named)]
    numbers = np.array([order.index(name) for name in named], dtype=np.int64)
    return Grouping(numbers, threshold, tuple(order))


def _with_charges(found: Sequence[Finding], charges: Sequence[Charge]) -> tuple[Finding, ...]:
    """Put broken rules in front; what is said by them is not said again."""
    rules = [charge.finding for charge in charges]
    said = {rule.expected for rule in rules if rule.missing}
    return (*rules, *(item for item in found if not (item.missing and item.expected in said)))
