"""Which steps of a demonstration are strange: from what a score says to places in the video.

A finding is always about what raised the loss: for the default score an omitted step, a step out
of order or an unusual next step; for equation 3 a surprising next step or an omission.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from filtering.judging.equation3.score import Score
from filtering.judging.equation3.sequence import Transitions
from filtering.judging.explain import Finding, gravest
from filtering.judging.norm.norm_score import TRANSITION, NormScore
from teasim.pool import Span

NOTABLE = 1.0
"""Smallest surprise worth a mark on the timeline, unless there is no larger one [nats]."""

Findings = tuple[Finding, ...]
"""Strange places of a demonstration, the one to name first."""
Order = NDArray[np.float64]
"""(T, T) how often a comes first before b."""


def find_departures(
    score: NormScore,
    labels: Sequence[Sequence[int]],
    places: "Places",
    vain: Sequence[NDArray[np.float64]] | None = None,
) -> tuple[Findings, ...]:
    """Return per demonstration where it departs from the norm.

    Args:
        score: the default score of the pool.
        labels: per demonstration its q sub-task labels, 0..T-1.
        places: its segments and their names.
        vain: per demonstration (q,) what each segment adds of which nothing came [nats].
    """
    order = usual_order(labels, score.trust, len(places.subtasks))
    found = []
    for demo in range(len(labels)):
        said = _departures(score, demo, list(labels[demo]), order, places)
        if vain is not None:
            said += places.idle(demo, vain[demo])
        found.append(_gravest_first(said))
    return tuple(found)


def find_surprises(
    rows: Transitions, score: Score, labels: Sequence[Sequence[int]], places: "Places"
) -> tuple[Findings, ...]:
    """Return per demonstration the steps that surprise equation 3; arguments as above."""
    order = usual_order(labels, score.weights, rows.n_subtasks)
    return tuple(
        _surprises(_Steps(rows, score, demo), order, places, demo) for demo in range(len(labels))
    )


def usual_order(
    labels: Sequence[Sequence[int]], weights: NDArray[np.float64], n_subtasks: int
) -> Order:
    """Return (T, T): how often sub-task a first comes before b where both occur, 0.5 if never.

    Args:
        labels: the demonstrations.
        weights: (D,) how much each demonstration counts.
        n_subtasks: T.
    """
    before = np.full((n_subtasks, n_subtasks), 0.5)
    both = np.ones_like(before)
    for steps, weight in zip(labels, weights, strict=True):
        first = np.full(n_subtasks, np.inf)
        for position in range(len(steps) - 1, -1, -1):
            first[steps[position]] = position
        occurs = np.isfinite(first)
        both += weight * (occurs[:, None] & occurs[None, :])
        before += weight * ((first[:, None] < first[None, :]) & occurs[None, :])
    return before / both


class Places:
    """Where steps are in the videos of a pool, and what they are called."""

    def __init__(self, segments: Sequence[tuple[Span, ...]], subtasks: Sequence[str]) -> None:
        """Take per demonstration its q segments, and the names of the T labels."""
        self.segments = segments
        self.subtasks = subtasks

    def finding(self, demo: int, row: int, label: int, surprise: float) -> Finding:
        """Return that `label` (T is the end) was expected after `row` segments."""
        spans = self.segments[demo]
        seen = spans[row] if row < len(spans) else None
        expected = self.subtasks[label] if label < len(self.subtasks) else None
        return Finding(
            expected=expected,
            seen=seen.subtask if seen else None,
            after=spans[row - 1] if row else None,
            frame=seen.start if seen else spans[-1].stop,
            missing=expected is not None and all(s.subtask != expected for s in spans),
            surprise=surprise,
            came=next((s for s in spans[row:] if s.subtask == expected), None),
        )

    def idle(self, demo: int, surprises: NDArray[np.float64]) -> list[Finding]:
        """Return the segments of which nothing came, for what each of them adds (q,) [nats]."""
        spans = self.segments[demo]
        return [
            Finding(
                expected=spans[row].subtask,
                seen=spans[row].subtask,
                after=spans[row - 1] if row else None,
                frame=spans[row].start,
                missing=False,
                surprise=float(surprises[row]),
                idle=spans[row],
            )
            for row in np.flatnonzero(surprises > 0).tolist()
        ]


def _departures(
    score: NormScore, demo: int, labels: list[int], order: Order, places: Places
) -> list[Finding]:
    """Join what the blocks of the default score say about the same place."""
    said = [
        *_omissions(score, demo, labels, order),
        *_disorder(score, demo, labels, order),
    ]
    _add_unusual_step(said, score, demo, labels)
    if not said:
        return []
    # To be of the other population may have no step of its own: then it is more of the worst.
    worst = max(range(len(said)), key=lambda k: said[k][2])
    row, label, surprise = said[worst]
    rest = float(score.losses[demo]) - sum(each[2] for each in said)
    said[worst] = (row, label, surprise + rest)
    return [places.finding(demo, *each) for each in said]


def _gravest_first(found: Sequence[Finding]) -> Findings:
    """Return the notable findings, or else the worst one."""
    ordered = sorted(found, key=lambda item: (-round(item.surprise, 6), item.frame))
    return tuple(item for item in ordered if item.surprise >= NOTABLE) or tuple(ordered[:1])


Said = tuple[int, int, float]
"""After how many segments, the label that was expected there, surprise [nats]."""


def _omissions(score: NormScore, demo: int, labels: list[int], order: Order) -> list[Said]:
    """What is left out; to be one of those who leave out much counts for what they leave out."""
    absent = np.ones(len(order), dtype=bool)
    absent[labels] = False
    shared = np.where(absent, score.lack, 0.0)
    surprise = score.omitted[demo] + score.systematic[demo] * shared / max(shared.sum(), 1e-12)
    return [
        (place_of(label, labels, order), label, float(surprise[label]))
        for label in np.flatnonzero(absent & (surprise > 0)).tolist()
    ]


def _disorder(score: NormScore, demo: int, labels: list[int], order: Order) -> list[Said]:
    """Explain the violated pairs by as few displaced steps as it takes, the gravest first."""
    left = score.misplaced[demo].copy()
    total = left.sum()
    said = []
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
        said.append((*_where(pairs > 0, labels, order), surprise))
    return said


def _where(pairs: NDArray[np.bool_], labels: list[int], order: Order) -> tuple[int, int]:
    """Return the first segment that should have come after another, and which other."""
    awaited = set(np.flatnonzero(pairs.any(axis=1)).tolist())
    early = set(np.flatnonzero(pairs.any(axis=0)).tolist())
    last = max(k for k, label in enumerate(labels) if label in awaited)
    row = next(k for k, label in enumerate(labels[:last]) if label in early)
    waiting = sorted(awaited & set(labels[row + 1 :]))
    return row, max(waiting, key=lambda label: float(order[label, waiting].sum()))


def _add_unusual_step(said: list[Said], score: NormScore, demo: int, labels: list[int]) -> None:
    """Add the worst next step; mostly it is the echo of what is missing or out of order there."""
    surprise = float(TRANSITION * score.transition[demo])
    if surprise <= 0:
        return
    start, end, expected = score.worst_step[demo].tolist()
    path = [len(score.lack), *labels, len(score.lack)]
    row = next(k for k in range(len(path) - 1) if (path[k], path[k + 1]) == (start, end))
    for place, (where, label, known) in enumerate(said):
        if where == row:
            said[place] = (row, label, known + surprise)
            return
    said.append((row, expected, surprise))


def place_of(omitted: int, labels: Sequence[int], order: Order) -> int:
    """Return the row at which most of the other sub-tasks say an omitted one belongs."""
    agreement = [
        sum(order[label, omitted] for label in labels[:row])
        + sum(order[omitted, label] for label in labels[row:])
        for row in range(len(labels) + 1)
    ]
    return int(np.argmax(agreement))


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


def _surprises(steps: _Steps, order: Order, places: Places, demo: int) -> Findings:
    """Join each omission to the strange step at its place, if it is what was expected there."""
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


def _first_cause(found: list[Finding]) -> Findings:
    """One displaced step makes later steps strange as well: of the grave ones, the first leads."""
    if not found:
        return ()
    first = min(gravest(found), key=lambda item: (item.frame, -item.surprise))
    return (first, *(item for item in found if item is not first))
