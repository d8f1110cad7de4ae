"""Which step of a demonstration is strange, where in the video, and why, in one sentence."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.sequence import Transitions
from filtering.weights.score import Score
from teasim.pool import Span

NOTABLE = 1.0
"""Smallest surprise worth a mark on the timeline [nats]."""

GRAVE = 0.5
"""Share of the worst surprise from which a finding may be the one that is named."""


@dataclass(frozen=True)
class Finding:
    """One strange place in a demonstration."""

    expected: str | None
    """Sub-task that was expected here; None where the end of the video was."""
    seen: str | None
    """Sub-task that was seen instead; None where the video ends."""
    after: Span | None
    """Segment before; None at the start of the video."""
    frame: int
    """First frame of what was seen, or the frame at which the last segment ends."""
    missing: bool
    """Whether the expected sub-task does not occur anywhere in the demonstration."""
    surprise: float
    """Surprise of the step and of the omission together [nats]."""


def find_strange_steps(
    rows: Transitions,
    score: Score,
    segments: Sequence[tuple[Span, ...]],
    subtasks: Sequence[str],
) -> list[tuple[Finding, ...]]:
    """Return per demonstration its findings of NOTABLE surprise or more, the worst first."""
    order = usual_order(rows, score.weights)
    return [
        _findings_of(_Steps(rows, score, demo), spans, order, subtasks)
        for demo, spans in enumerate(segments)
    ]


def usual_order(rows: Transitions, weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (T, T): how often sub-task a first comes before b where both occur, 0.5 if never.

    Args:
        rows: the pool.
        weights: (D,) how much each demonstration counts.
    """
    before = np.full((rows.n_subtasks, rows.n_subtasks), 0.5)
    both = np.ones_like(before)
    for demo in range(rows.n_demos):
        labels = rows.nexts[rows.demos == demo][:-1].tolist()
        first = np.full(rows.n_subtasks, np.inf)
        for position in range(len(labels) - 1, -1, -1):
            first[labels[position]] = position
        occurs = np.isfinite(first)
        both += weights[demo] * (occurs[:, None] & occurs[None, :])
        before += weights[demo] * ((first[:, None] < first[None, :]) & occurs[None, :])
    return before / both


class _Steps:
    """What the score says about one demonstration."""

    def __init__(self, rows: Transitions, score: Score, demo: int) -> None:
        mine = rows.demos == demo
        self.labels: list[int] = rows.nexts[mine][:-1].tolist()
        self.expected: list[int] = score.log_probabilities[mine].argmax(axis=1).tolist()
        self.surprise: list[float] = score.step[mine].tolist()
        omission = score.omission[demo]
        self.omitted = {
            label: float(omission[label]) for label in np.flatnonzero(omission >= NOTABLE).tolist()
        }

    def place_of(self, omitted: int, order: NDArray[np.float64]) -> int:
        """Return the row at which most of the other sub-tasks say an omitted one belongs."""
        agreement = [
            sum(order[label, omitted] for label in self.labels[:row])
            + sum(order[omitted, label] for label in self.labels[row:])
            for row in range(len(self.labels) + 1)
        ]
        return int(np.argmax(agreement))


def _findings_of(
    steps: _Steps, spans: tuple[Span, ...], order: NDArray[np.float64], subtasks: Sequence[str]
) -> tuple[Finding, ...]:
    """Join each omission to the strange step at its place, if it is what was expected there."""
    found = []
    explained = set()
    for label, omission in steps.omitted.items():
        row = steps.place_of(label, order)
        surprise = omission
        if steps.expected[row] == label:
            surprise += steps.surprise[row]
            explained.add(row)
        found.append(_finding(row, label, spans, subtasks, True, surprise))
    for row, surprise in enumerate(steps.surprise):
        if surprise >= NOTABLE and row not in explained:
            label = steps.expected[row]
            missing = label in steps.omitted
            found.append(_finding(row, label, spans, subtasks, missing, surprise))
    return tuple(sorted(found, key=lambda finding: -finding.surprise))


def _finding(
    row: int,
    label: int,
    spans: tuple[Span, ...],
    subtasks: Sequence[str],
    missing: bool,
    surprise: float,
) -> Finding:
    seen = spans[row] if row < len(spans) else None
    return Finding(
        expected=subtasks[label] if label < len(subtasks) else None,
        seen=seen.subtask if seen else None,
        after=spans[row - 1] if row else None,
        frame=seen.start if seen else spans[-1].stop,
        missing=missing,
        surprise=surprise,
    )


def explain(findings: Sequence[Finding], fps: float) -> str:
    """Return one sentence about the gravest finding, and what else is missing."""
    if not findings:
        return (
            "No single step stands out, but all steps together are less usual than those of the "
            "kept demonstrations."
        )
    # One displaced step makes later steps strange as well: of those that matter, name the first.
    worst = min(gravest(findings), key=lambda item: (item.frame, -item.surprise))
    sentence = f"{_place(worst, fps)} {_expectation(worst)}, {_sight(worst, fps)}"
    if worst.missing:
        sentence += f"; '{worst.expected}' is missing from the whole video"
    others = {item.expected: item for item in reversed(findings) if item.missing}
    others.pop(worst.expected, None)
    if others:
        where = ", ".join(
            f"'{item.expected}' (expected at {_at(item, fps)})" for item in others.values()
        )
        sentence += f"; {'also missing' if worst.missing else 'missing'}: {where}"
    return sentence + "."


def gravest(findings: Sequence[Finding]) -> list[Finding]:
    """Return the findings at least GRAVE times as surprising as the worst one."""
    return [item for item in findings if item.surprise >= GRAVE * findings[0].surprise]


def _place(finding: Finding, fps: float) -> str:
    if finding.after is None:
        return "At the start of the video"
    span = finding.after
    return f"After {span.subtask} ({span.start / fps:.1f}-{span.stop / fps:.1f} s)"


def _expectation(finding: Finding) -> str:
    if finding.expected is None:
        return "the end of the video was expected"
    return f"'{finding.expected}' was expected"


def _sight(finding: Finding, fps: float) -> str:
    if finding.seen is None:
        return f"but the video ends at {_at(finding, fps)}"
    return f"'{finding.seen}' was seen at {_at(finding, fps)}"


def _at(finding: Finding, fps: float) -> str:
    return f"{finding.frame / fps:.1f} s"
