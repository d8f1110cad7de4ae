"""The score `combined`: the graver of two verdicts, of the norm on sub-tasks and of moments.

The norm judges whole steps, and is sure where the sub-tasks are found as they are; moments see what
no sub-task stands for, and need none. Where sub-tasks are merged or split, the norm says little;
what is done in another way or at another place says little to moments. Either may flag:

    weight = min(w_norm, w_moments),    loss = -log weight.
"""

import numpy as np

from filtering.judging.explain import explain
from filtering.judging.judgement import Judgement
from filtering.judging.thresholds import Grouping, group_weights

NATURES = ("kept", "out of order", "steps left out", "extra steps")
"""Groups of both, the best first."""
LEAST_WEIGHT = 1e-9
"""Keeps the logarithm of a weight finite."""


def combine(
    norm: Judgement, moments: Judgement, fps: float | None, groups: str = "auto"
) -> Judgement:
    """Put two judgements of the same D demonstrations together.

    Args:
        norm: by sub-tasks, with named groups.
        moments: by moments, with named groups and a reason for each demonstration.
        fps: frames per second, None where it is not known.
        groups: how many groups there are, or auto: by the nature of the mistake.

    Raises:
        ConfigError: there are fewer demonstrations than groups.
    """
    late = moments.weights < norm.weights
    weights = np.maximum(np.where(late, moments.weights, norm.weights), LEAST_WEIGHT)
    reasons = moments.reasons or ("",) * len(weights)
    pairs = list(zip(late, norm.findings, moments.findings, reasons, strict=True))
    grouping = _by_nature(norm.grouping, moments.grouping, late)
    if groups != "auto" and int(groups) != grouping.count:
        grouping = group_weights(weights, groups)
    return Judgement(
        losses=-np.log(weights),
        weights=weights,
        grouping=grouping,
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
