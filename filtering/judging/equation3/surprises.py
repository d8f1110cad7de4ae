"""Which steps of a demonstration surprise equation 3: next steps and omissions."""

from collections.abc import Sequence

import numpy as np

from filtering.judging.equation3.score import Score
from filtering.judging.equation3.sequence import Transitions
from filtering.judging.explain import Finding, gravest
from filtering.judging.places import NOTABLE, Places, place_of, usual_order
from teasim.common.arrays import Array


def find_surprises(
    rows: Transitions, score: Score, labels: Sequence[Sequence[int]], places: Places
) -> tuple[tuple[Finding, ...], ...]:
    """Return per demonstration the steps that surprise equation 3, the first cause first.

    Args:
        rows: states and next sub-tasks of the pool.
        score: the leave-one-out score of these rows.
        labels: per demonstration its q sub-task labels, 0..T-1.
        places: its segments and their names.
    """
    order = usual_order(labels, score.weights, rows.n_subtasks)
    return tuple(
        _surprises(_Steps(rows, score, demo), order, places, demo) for demo in range(len(labels))
    )


class _Steps:
    """What equation 3 says about one demonstration."""

    def __init__(self, rows: Transitions, score: Score, demo: int) -> None:
        mine = rows.demos == demo
        self.labels: list[int] = rows.nexts[mine][:-1].tolist()
        self.expected: list[int] = score.log_probabilities[mine].argmax(axis=1).tolist()
        self.surprise: list[float] = score.step[mine].tolist()
        omission = score.omission[demo]
        self.omitted = {
            label: float(omission[label]) for label in np.flatnonzero(omission > 0).tolist()
        }


def _surprises(steps: _Steps, order: Array, places: Places, demo: int) -> tuple[Finding, ...]:
    """Merge each omission with the surprising step at its place, if that step expected it."""
    found = []
    explained = set()
    for label, omission in steps.omitted.items():
        row = place_of(label, steps.labels, order)
        surprise = omission
        if steps.expected[row] == label:
            surprise += steps.surprise[row]
            explained.add(row)
        found.append(places.finding(demo, row, label, surprise))
    for row, surprise in enumerate(steps.surprise):
        if surprise > 0 and row not in explained:
            found.append(places.finding(demo, row, steps.expected[row], surprise))
    found.sort(key=lambda finding: -finding.surprise)
    notable = [item for item in found if item.surprise >= NOTABLE] or found[:1]
    return _first_cause(notable)


def _first_cause(found: list[Finding]) -> tuple[Finding, ...]:
    """Put the first of the gravest findings in front: a displaced step also disturbs later ones."""
    if not found:
        return ()
    first = min(gravest(found), key=lambda item: (item.frame, -item.surprise))
    return (first, *(item for item in found if item is not first))
