"""What the page shows beside a flagged demonstration: its odd stretch, and the same one elsewhere.

For a missing step that is the place where it was expected, and a trusted video that carries it out;
for a step at an unusual place, where others have it; for an ineffective one, the pictures before
and after it in both.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from filtering.demo_filter import DemoFilter
from filtering.judging.explain import Finding, gravest
from teasim.pool import Span
from teasim.pool.source import Source

MOST = 3
"""Most exhibits of a demonstration; smaller findings mostly follow from the larger ones."""
SHORTEST = 2.0
"""Least length of a stretch that is only a place [s]: enough to see what happens there."""


@dataclass(frozen=True)
class Excerpt:
    """A stretch of a video with one or two pictures of it."""

    demo: int
    """Position of the demonstration in the pool."""
    span: Span
    """Its frames."""
    frames: tuple[int, ...]
    """Frames that are shown before it is played: one of it, or those before and after it."""


@dataclass(frozen=True)
class Exhibit:
    """A finding, where it is in its demonstration, and how another demonstration does it."""

    finding: Finding
    """What is odd."""
    own: Excerpt
    """Where in the demonstration."""
    other: Excerpt | None
    """The same step in a trusted demonstration; None where none has it."""


def shown(findings: Sequence[Finding]) -> list[Finding]:
    """Return what is missing and the largest other findings; smaller ones follow from those."""
    grave = gravest(findings) if findings else []
    return [item for item in findings if item.missing or item in grave]


def exhibits_of(pool: Source, fitted: DemoFilter, demo: int) -> tuple[Exhibit, ...]:
    """Return what is shown beside the demonstration at the position `demo`; labels are not read."""
    return tuple(
        _exhibit(pool, fitted, demo, item) for item in shown(fitted.findings_[demo])[:MOST]
    )


def _exhibit(pool: Source, fitted: DemoFilter, demo: int, finding: Finding) -> Exhibit:
    there = _elsewhere(fitted, demo, finding)
    known = finding.ineffective or finding.came or finding.extra
    stretch = known or _around(pool, demo, finding.frame, there[1] if there else None)
    both = finding.ineffective is not None
    own = _excerpt(pool, demo, stretch, both=both, at=None if known else finding.frame)
    other = None if there is None else _excerpt(pool, *there, both=both)
    return Exhibit(finding, own, other)


def _elsewhere(fitted: DemoFilter, demo: int, finding: Finding) -> tuple[int, Span] | None:
    """Return which demonstration shows what was expected, and where."""
    if finding.counterpart is not None:
        return finding.counterpart.demo, finding.counterpart.span
    if finding.extra is not None:
        return None  # nothing is expected
    spans = fitted.segments_.spans
    for other in _by_trust(fitted):
        if other == demo or not spans[other]:
            continue
        if finding.expected is None:
            return other, spans[other][-1]
        own = [span for span in spans[other] if span.subtask == finding.expected]
        if own:
            return other, max(own, key=lambda span: (span.stop - span.start, -span.start))
    return None


def _by_trust(fitted: DemoFilter) -> list[int]:
    """Return the positions of the kept demonstrations, the most trusted first."""
    kept = [demo for demo, flagged in enumerate(fitted.flagged_) if not flagged]
    return sorted(kept, key=lambda demo: (-fitted.trust_[demo], -fitted.weights_[demo], demo))


def _around(pool: Source, demo: int, frame: int, model: Span | None) -> Span:
    """Return a stretch about a frame, as long as the step that was expected there."""
    length = pool.episodes[demo].length
    wanted = max(round(SHORTEST * (pool.fps or 1.0)), model.stop - model.start if model else 0)
    start = max(0, min(frame - wanted // 2, length - wanted))
    return Span("stretch", start, min(length, start + wanted))


def _excerpt(pool: Source, demo: int, span: Span, *, both: bool, at: int | None = None) -> Excerpt:
    """Return a stretch with the pictures before and after it, or that of one frame in it."""
    last = pool.episodes[demo].length - 1
    middle = (span.start + span.stop) // 2 if at is None else at
    frames = (max(0, span.start - 1), min(span.stop, last)) if both else (min(middle, last),)
    return Excerpt(demo, span, frames)
