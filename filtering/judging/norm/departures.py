"""Where a demonstration departs from the norm: the places in the video that raised its loss.

An omitted step, a step out of order, an unusual next step, or an ineffective step.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from filtering.judging.explain import Finding
from filtering.judging.norm.norm_score import TRANSITION, NormScore
from filtering.judging.places import NOTABLE, Places, place_of, usual_order
from teasim.common.arrays import Array

Departure = tuple[int, int, float]
"""Number of segments before it, the label that was expected there, surprise [nats]."""


def find_departures(
    score: NormScore,
    labels: Sequence[Sequence[int]],
    places: Places,
    ineffective: Sequence[Array] | None = None,
) -> tuple[tuple[Finding, ...], ...]:
    """Return per demonstration where it departs from the norm, the most important place first.

    Args:
        score: the default score of the pool.
        labels: per demonstration its q sub-task labels, 0..T-1.
        places: its segments and their names.
        ineffective: per demonstration (q,) what each segment adds for being ineffective [nats].
    """
    order = usual_order(labels, score.trust, len(places.subtasks))
    result = []
    for demo in range(len(labels)):
        found = _departures(score, demo, list(labels[demo]), order)
        findings = [places.finding(demo, *departure) for departure in found]
        if ineffective is not None:
            findings += places.ineffective(demo, ineffective[demo])
        result.append(_notable(findings))
    return tuple(result)


def _departures(score: NormScore, demo: int, labels: list[int], order: Array) -> list[Departure]:
    """Merge what the blocks of the default score find at the same place."""
    found = [
        *_omissions(score, demo, labels, order),
        *_disorder(score, demo, labels, order),
    ]
    _add_unusual_step(found, score, demo, labels)
    if not found:
        return []
    # The loss for belonging to the other population may have no step of its own: it is then added
    # to the worst departure.
    worst = max(range(len(found)), key=lambda k: found[k][2])
    row, label, surprise = found[worst]
    rest = float(score.losses[demo]) - sum(each[2] for each in found)
    found[worst] = (row, label, surprise + rest)
    return found


def _notable(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the notable findings by falling surprise, or else the worst one."""
    ordered = sorted(findings, key=lambda item: (-round(item.surprise, 6), item.frame))
    return tuple(item for item in ordered if item.surprise >= NOTABLE) or tuple(ordered[:1])


def _omissions(score: NormScore, demo: int, labels: list[int], order: Array) -> list[Departure]:
    """Return the omitted steps; the loss of the population that omits them is shared among them."""
    absent = np.ones(len(order), dtype=bool)
    absent[labels] = False
    shared = np.where(absent, score.lack, 0.0)
    surprise = score.omitted[demo] + score.systematic[demo] * shared / max(shared.sum(), 1e-12)
    return [
        (place_of(label, labels, order), label, float(surprise[label]))
        for label in np.flatnonzero(absent & (surprise > 0)).tolist()
    ]


def _disorder(score: NormScore, demo: int, labels: list[int], order: Array) -> list[Departure]:
    """Explain the violated pairs by as few displaced steps as possible, the worst first."""
    left = score.misplaced[demo].copy()
    total = left.sum()
    found = []
    while left.max(initial=0.0) > 0:
        too_late, too_early = left.sum(axis=1), left.sum(axis=0)
        pairs = np.zeros_like(left)
        if too_early.max() >= too_late.max():
            step = int(too_early.argmax())
            pairs[:, step] = left[:, step]
        else:
            step = int(too_late.argmax())
            pairs[step] = left[step]
        left -= pairs
        surprise = float(score.precedence[demo] * pairs.sum() / total)
        found.append((*_where(pairs > 0, labels, order), surprise))
    return found


def _where(pairs: NDArray[np.bool_], labels: list[int], order: Array) -> tuple[int, int]:
    """Return the row of the first segment that came too early, and the label expected there."""
    awaited = set(np.flatnonzero(pairs.any(axis=1)).tolist())
    early = set(np.flatnonzero(pairs.any(axis=0)).tolist())
    last = max(k for k, label in enumerate(labels) if label in awaited)
    row = next(k for k, label in enumerate(labels[:last]) if label in early)
    waiting = sorted(awaited & set(labels[row + 1 :]))
    return row, max(waiting, key=lambda label: float(order[label, waiting].sum()))


def _add_unusual_step(
    found: list[Departure], score: NormScore, demo: int, labels: list[int]
) -> None:
    """Add the worst transition; it mostly follows from what is missing or misplaced there."""
    surprise = float(TRANSITION * score.transition[demo])
    if surprise <= 0:
        return
    start, end, expected = score.worst_step[demo].tolist()
    path = [len(score.lack), *labels, len(score.lack)]
    row = next(k for k in range(len(path) - 1) if (path[k], path[k + 1]) == (start, end))
    for number, (where, label, known) in enumerate(found):
        if where == row:
            found[number] = (row, label, known + surprise)
            return
    found.append((row, expected, surprise))
