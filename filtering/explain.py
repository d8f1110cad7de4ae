"""Which step of a demonstration is strange, where in the video, and why, in one sentence."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

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
    return [
        _findings_of(
            score.log_probabilities[rows.demos == demo],
            score.step[rows.demos == demo],
            score.omission[demo],
            spans,
            subtasks,
        )
        for demo, spans in enumerate(segments)
    ]


def _findings_of(
    log_p: np.ndarray,
    step: np.ndarray,
    omission: np.ndarray,
    spans: tuple[Span, ...],
    subtasks: Sequence[str],
) -> tuple[Finding, ...]:
    """Attach each omission to the step at which it was most expected, then take the rest."""
    expected = log_p.argmax(axis=1).tolist()
    total = np.where(step >= NOTABLE, step, 0.0)
    missing = np.zeros(len(step), dtype=bool)
    found = []
    for label in np.argsort(-omission, kind="stable").tolist():
        if omission[label] < NOTABLE:
            break
        row = int(log_p[:, label].argmax())
        if expected[row] == label:
            total[row] = step[row] + omission[label]
            missing[row] = True
        else:
            found.append(_finding(row, label, spans, subtasks, True, float(omission[label])))
    for row in np.flatnonzero(total >= NOTABLE).tolist():
        found.append(
            _finding(row, expected[row], spans, subtasks, bool(missing[row]), float(total[row]))
        )
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
    worst = min(gravest(findings), key=lambda item: item.frame)
    sentence = f"{_place(worst, fps)} {_expectation(worst)}, {_sight(worst, fps)}"
    if worst.missing:
        sentence += f"; '{worst.expected}' is missing from the whole video"
    others = [item for item in findings if item.missing and item is not worst]
    if others:
        where = ", ".join(f"'{item.expected}' (expected at {_at(item, fps)})" for item in others)
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
