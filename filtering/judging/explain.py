"""One sentence about a demonstration: which step is unusual, where, and why."""

from collections.abc import Sequence
from dataclasses import dataclass

from teasim.pool import Span

ODD = 0.8
"""Weight below which it is also said of a kept demonstration what was odd. A round number: a
learner would feel the missing fifth."""
GRAVE = 0.5
"""Share of the largest surprise from which a finding may be named first."""


@dataclass(frozen=True)
class Clock:
    """Converts frames to times of the video, or to frame numbers where the rate is not known."""

    fps: float | None
    """Frames per second."""

    @property
    def unit(self) -> str:
        """Unit of `time`: s or frames."""
        return "frames" if self.fps is None else "s"

    def time(self, frame: int) -> float:
        """Return the time at which a frame begins [unit]."""
        return frame / (self.fps or 1.0)

    def at(self, frame: int) -> str:
        """Return the time of a frame in words."""
        return f"frame {frame}" if self.fps is None else f"{self.time(frame):.1f} s"

    def during(self, span: Span) -> str:
        """Return the interval of a segment in words."""
        if self.fps is None:
            return f"frames {span.start}-{span.stop}"
        return f"{self.time(span.start):.1f}-{self.time(span.stop):.1f} s"


@dataclass(frozen=True)
class Counterpart:
    """Where another demonstration shows what a finding is about."""

    demo: int
    """Position of that demonstration in the pool."""
    span: Span
    """Its frames."""
    camera: str
    """Camera that shows it best."""


@dataclass(frozen=True)
class Finding:
    """One unusual place in a demonstration."""

    expected: str | None
    """Sub-task that was expected here; None where the end of the video was expected."""
    seen: str | None
    """Sub-task that was seen instead; None where the video ends."""
    after: Span | None
    """Segment before this place; None at the start of the video."""
    frame: int
    """First frame of the sub-task seen, or the frame at which the last segment ends."""
    missing: bool
    """Whether the expected sub-task does not occur anywhere in the demonstration."""
    surprise: float
    """What it adds to the loss [nats]."""
    came: Span | None = None
    """Segment in which the expected sub-task came later; None where it did not."""
    ineffective: Span | None = None
    """Segment of the expected sub-task when it was carried out without effect; else None."""
    extra: Span | None = None
    """Segment of a step that few others carry out, or that often; else None."""
    rule: str = ""
    """Rule of the user that is broken here, in words; empty where the pool alone accuses."""
    counterpart: Counterpart | None = None
    """Where another demonstration shows it; None where the segments of its sub-task tell."""


NO_STEP = "No single step stands out, but all steps together are less usual than most."
"""What is said where there is no finding."""


def explain(findings: Sequence[Finding], fps: float | None, otherwise: str = NO_STEP) -> str:
    """Return one sentence about the first finding and all other missing sub-tasks.

    Args:
        findings: of one demonstration, the most important one first.
        fps: frames per second; None where it is not known.
        otherwise: what to say where there is no finding.
    """
    if not findings:
        return otherwise
    clock = Clock(fps)
    named = findings[0]
    if named.ineffective is not None:
        when = clock.during(named.ineffective)
        sentence = f"'{named.expected}' was carried out ({when}), but it had no visible effect"
    elif named.extra is not None:
        when = clock.during(named.extra)
        sentence = f"'{named.seen}' was carried out ({when}), which few others do so often"
    elif named.rule:
        sentence = _breach(named, clock)
    else:
        sentence = f"{_place(named, clock)} {_expectation(named)}, {_sight(named, clock)}"
    if named.missing and not named.rule:
        sentence += f"; '{named.expected}' is missing from the whole video"
    elif named.came is not None:
        sentence += f"; '{named.expected}' came later ({clock.during(named.came)})"
    others = {item.expected: item for item in reversed(findings) if item.missing}
    others.pop(named.expected, None)
    if others:
        where = ", ".join(
            f"'{item.expected}' (expected at {clock.at(item.frame)})" for item in others.values()
        )
        sentence += f"; {'also missing' if named.missing else 'missing'}: {where}"
    return sentence + "."


def kept_though(sentence: str) -> str:
    """Return what was odd about a demonstration that is kept, given the sentence about it."""
    return f"Kept, though odd: {sentence}"


def gravest(findings: Sequence[Finding]) -> list[Finding]:
    """Return the findings at least GRAVE times as surprising as the worst one."""
    worst = max(item.surprise for item in findings)
    return [item for item in findings if item.surprise >= GRAVE * worst]


def _breach(finding: Finding, clock: Clock) -> str:
    """Return how a rule of the user is broken; where nobody does a step, it has no usual place."""
    if not finding.missing:
        return f"This demonstration breaks the rule: {finding.rule}; {_sight(finding, clock)}"
    nowhere = finding.after is None and finding.seen is None
    where = "" if nowhere else f" (expected at {clock.at(finding.frame)})"
    return f"{finding.rule}, and it is missing from the whole video{where}"


def _place(finding: Finding, clock: Clock) -> str:
    if finding.after is None:
        return "At the start of the video"
    return f"After {finding.after.subtask} ({clock.during(finding.after)})"


def _expectation(finding: Finding) -> str:
    if finding.expected is None:
        return "the end of the video was expected"
    return f"'{finding.expected}' was expected"


def _sight(finding: Finding, clock: Clock) -> str:
    if finding.seen is None:
        return f"but the video ends at {clock.at(finding.frame)}"
    return f"'{finding.seen}' was seen at {clock.at(finding.frame)}"
