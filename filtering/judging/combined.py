"""The score `combined`: the graver of two verdicts, of the norm on sub-tasks and of moments.

The norm judges whole steps, and is sure where the sub-tasks are found as they are; moments see what
no sub-task stands for, and need none. Either may flag:

    weight = min(w_norm, w_moments),    loss = -log weight.

The norm is heard only where its sub-tasks are confirmed by counterparts, and where orders are not
free: it would take rare orders for wrong ones. On sub-tasks that clustering found it needs a second
witness too (`unless_alone`): that moments find the demonstration a little unusual, or, if it is out
of order, that it keeps the order of less than half of the others. Sub-tasks that were cut wrongly
in one video have none.
"""

from dataclasses import replace

import numpy as np

from filtering.judging.explain import explain
from filtering.judging.judgement import Judgement
from filtering.judging.norm.cut import NATURES
from filtering.judging.thresholds import Grouping, as_many_as_asked
from teasim.common.arrays import Array

CONFIRMED = 0.85
"""Least agreement of sub-tasks with counterparts, see `confirmed.confirmation`. In pools of the
scenes TUNED_ON and of tea-making it is 0.85 or more, but 0.5 to 0.65 where a scene's sub-tasks were
mixed up and correct videos accused."""
ONE_ORDER = 0.3
"""Least share of the pairs of demonstrations that keep one order. With three camps of 6, 4 and 2 of
12 it is 0.33; in the free-order pools of those scenes that the norm accuses it is 0.25 or less."""
SUSPECT = 0.7
"""Least strength of the evidence of moments, 1 at their cut, that makes them a witness. In the
scenes TUNED_ON nearly all whom the norm alone accuses wrongly have less."""
MAJORITY = 0.5
"""Share of the others whose order a demonstration keeps, below which order is a witness."""
LEAST_WEIGHT = 1e-9
"""Keeps the logarithm of a weight finite."""


def doubts(confirmed: float, one_order: float) -> tuple[str, ...]:
    """Return why the norm is not heard, in sentences; empty if it is.

    Args:
        confirmed: agreement of the sub-tasks with counterparts.
        one_order: share of the pairs of demonstrations that keep one order.
    """
    found = []
    if one_order < ONE_ORDER:
        found.append(
            f"There are several ways of doing it: {one_order:.0%} of the pairs of demonstrations "
            "keep one order, so that another order is no evidence."
        )
    if confirmed < CONFIRMED:
        found.append(
            "The found sub-tasks are not the same in all videos, so that only moments are judged."
        )
    return tuple(found)


def unless_alone(norm: Judgement, strengths: Array, kept: Array) -> Judgement:
    """Return the judgement of the norm with those kept whom nothing else speaks against.

    Args:
        norm: by sub-tasks, with named groups.
        strengths: (D,) of the evidence of moments, 1 at their cut.
        kept: (D,) share of the others whose order each keeps.
    """
    grouping = norm.grouping
    in_order = np.array([name != NATURES[1] for name in grouping.names])[grouping.groups]
    witnesses = (strengths >= SUSPECT) | (~in_order & (kept < MAJORITY))
    return replace(
        norm,
        weights=np.where(witnesses, norm.weights, 1.0),
        losses=np.where(witnesses, norm.losses, 0.0),
        grouping=replace(grouping, groups=np.where(witnesses, grouping.groups, 0)),
    )


def combine(
    norm: Judgement | None, moments: Judgement, fps: float | None, groups: str = "auto"
) -> Judgement:
    """Put two judgements of the same D demonstrations together.

    Args:
        norm: by sub-tasks, with named groups; None if it is not heard.
        moments: by moments, with named groups and a reason for each demonstration.
        fps: frames per second, None where it is not known.
        groups: how many groups there are, or auto: by the nature of the mistake.

    Raises:
        ConfigError: there are fewer demonstrations than groups.
    """
    if norm is None:
        grouping = as_many_as_asked(moments.grouping, moments.weights, groups)
        return replace(moments, grouping=grouping)
    late = moments.weights < norm.weights
    weights = np.maximum(np.where(late, moments.weights, norm.weights), LEAST_WEIGHT)
    reasons = moments.reasons or ("",) * len(weights)
    pairs = list(zip(late, norm.findings, moments.findings, reasons, strict=True))
    natures = _by_nature(norm.grouping, moments.grouping, late)
    return Judgement(
        losses=-np.log(weights),
        weights=weights,
        grouping=as_many_as_asked(natures, weights, groups),
        trust=norm.trust,
        findings=tuple(
            theirs + ours if second else ours + theirs for second, ours, theirs, _ in pairs
        ),
        reasons=tuple(
            reason if second else explain(ours, fps) for second, ours, _, reason in pairs
        ),
        probabilities=1 - weights,
    )


def _by_nature(norm: Grouping, moments: Grouping, late: np.ndarray) -> Grouping:
    """Group by what the graver verdict says; both flag below a weight of one half."""
    numbers = [
        NATURES.index((moments if second else norm).names[(moments if second else norm).groups[d]])
        for d, second in enumerate(late.tolist())
    ]
    present, groups = np.unique(np.append(0, numbers), return_inverse=True)
    names = tuple(NATURES[number] for number in present)
    return Grouping(groups[1:].astype(np.int64), 0.5 * (len(present) > 1), names)
