"""Judge a pool by moments of its videos: the score `moments` in the form of every other score."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.judging.explain import Clock, Counterpart, Finding
from filtering.judging.judgement import Judgement
from filtering.judging.thresholds import Grouping, as_many_as_asked
from filtering.moments.evidence.stretches import Stretch
from filtering.moments.peers.peers import FEWEST, Looks
from filtering.moments.score import MomentFinding, MomentScore, score_comparable
from filtering.moments.suitable import Comparable
from filtering.vision.frame_features import sampled_frames
from teasim.pool import Span

NATURES = {
    "order": "out of order",
    "missing": "steps left out",
    "ineffective": "steps left out",
    "extra": "extra steps",
    "unexpected": "extra steps",
}
"""Group of a demonstration by the gravest kind of evidence against it."""
MOST_NAMED = 8
"""Most demonstrations that a sentence names."""
GROUPS = ("kept", "out of order", "steps left out", "extra steps")
"""Groups, the best first."""


@dataclass(frozen=True)
class Timeline:
    """How moments of a pool's videos become frames and names."""

    lengths: Sequence[int]
    """Frames of each demonstration."""
    names: Sequence[str]
    """What a person calls each demonstration."""
    fps: float | None
    """Frames per second; None where it is not known."""

    def span(self, stretch: Stretch, moments: int) -> Span:
        """Return the frames of a stretch of a video that was looked at in `moments` moments."""
        frames = sampled_frames(self.lengths[stretch.video], moments)
        last = int(frames[stretch.stop - 1]) + 1
        return Span(self.what(stretch, moments), int(frames[stretch.start]), last)

    def what(self, stretch: Stretch, moments: int) -> str:
        """Return what a stretch shows, named by where it is."""
        frames = sampled_frames(self.lengths[stretch.video], moments)
        start, stop = int(frames[stretch.start]), int(frames[stretch.stop - 1]) + 1
        place = Clock(self.fps).during(Span("stretch", start, stop))
        return f"what {self.names[stretch.video]} shows at {place}"


def judge_moments(
    seen: Comparable, timeline: Timeline, groups: str = "auto"
) -> tuple[Judgement, MomentScore]:
    """Judge demonstrations by what cameras saw of them; no label is read.

    Args:
        seen: what the cameras of use saw of the D demonstrations.
        timeline: their lengths and names.
        groups: how many groups there are, or auto.

    Raises:
        ConfigError: the videos are too few or too short, or there are fewer demonstrations than
            groups.
    """
    score = score_comparable(seen)
    weights = 1 - score.probabilities
    grouping = as_many_as_asked(_by_nature(score), weights, groups)
    counts = {camera: [len(video) for video in videos] for camera, videos in seen.videos.items()}
    findings = tuple(
        tuple(_finding(one, counts[one.camera], timeline) for one in found)
        for found in score.findings
    )
    reasons = tuple(reason(found[0], counts[found[0].camera], timeline) for found in score.findings)
    judged = Judgement(
        score.losses,
        weights,
        grouping,
        weights,
        findings,
        reasons=reasons,
        probabilities=score.probabilities,
    )
    return judged, score


def told_of_looks(looks: Mapping[str, Looks], names: Sequence[str]) -> tuple[str, ...]:
    """Return a sentence per look that is not the commonest one of its camera.

    Args:
        looks: per camera (D,) the same number for demonstrations that look alike.
        names: (D,) what a person calls the demonstrations.
    """
    return tuple(
        f"Camera {camera} sees another look in {members}, from beginning to end: what is usual "
        "among them does not count against them."
        for camera, members, _ in _uncommon(looks, names)
    )


def told_of_actors(actors: Mapping[str, Looks], names: Sequence[str]) -> tuple[str, ...]:
    """Return a sentence per actor that is not the commonest one of its camera.

    Args:
        actors: per camera (D,) the same number where what moves has the same colours.
        names: (D,) what a person calls the demonstrations.
    """
    return tuple(
        f"Camera {camera} sees another actor in {members}, told by the colours of what moves: "
        + (
            "what is usual among them does not count against them."
            if count >= FEWEST
            else "they are too few to tell whether a step of theirs had no effect."
        )
        for camera, members, count in _uncommon(actors, names)
    )


def _uncommon(looks: Mapping[str, Looks], names: Sequence[str]) -> Iterator[tuple[str, str, int]]:
    """Yield the camera, the members in words and their number of every look but the commonest."""
    for camera, of in looks.items():
        numbers, counts = np.unique(of, return_counts=True)
        for number in numbers[np.argsort(-counts, kind="stable")][1:]:
            members = [name for name, own in zip(names, of, strict=True) if own == number]
            more = f" and {len(members) - MOST_NAMED} more" if len(members) > MOST_NAMED else ""
            named = f"{', '.join(members[:MOST_NAMED])}{more}"
            yield camera, f"{len(members)} of {len(names)} demonstrations ({named})", len(members)


def reason(finding: MomentFinding, counts: Sequence[int], timeline: Timeline) -> str:
    """Return one sentence about a finding.

    Args:
        finding: what speaks against a demonstration.
        counts: moments of each video of its camera.
        timeline: lengths and names of the demonstrations.
    """
    own = timeline.span(finding.own, counts[finding.own.video])
    seen = timeline.what(finding.other, counts[finding.other.video])
    clock = Clock(timeline.fps)
    if finding.kind == "missing":
        return f"{_capital(seen)} is missing; it was expected at about {clock.at(own.start)}."
    if finding.kind == "order":
        return f"{_capital(seen)} came at an unusual place ({clock.during(own)})."
    if finding.kind == "extra":
        return f"What is seen at {clock.during(own)} is in few other videos."
    if finding.kind == "unexpected":
        return f"What changes in the picture at {clock.during(own)} changes in few other videos."
    return f"{_capital(seen)} was carried out ({clock.during(own)}), but without its usual effect."


def _capital(words: str) -> str:
    return words[0].upper() + words[1:]


def _finding(one: MomentFinding, counts: Sequence[int], timeline: Timeline) -> Finding:
    """Put a finding in the form of those that name sub-tasks."""
    own = timeline.span(one.own, counts[one.own.video])
    named = timeline.what(one.other, counts[one.other.video])
    return Finding(
        expected=None if one.kind in ("extra", "unexpected") else named,
        seen=None if one.kind == "missing" else own.subtask,
        after=None,
        frame=own.start,
        missing=one.kind == "missing",
        surprise=one.surprise,
        came=own if one.kind == "order" else None,
        ineffective=own if one.kind == "ineffective" else None,
        counterpart=Counterpart(
            one.other.video, timeline.span(one.other, counts[one.other.video]), one.camera
        ),
    )


def _by_nature(score: MomentScore) -> Grouping:
    numbers: NDArray[np.int64] = np.array(
        [
            GROUPS.index(NATURES[found[0].kind]) if flagged else 0
            for found, flagged in zip(score.findings, score.flagged, strict=True)
        ],
        dtype=np.int64,
    )
    present, groups = np.unique(np.append(0, numbers), return_inverse=True)
    names = tuple(GROUPS[number] for number in present)
    return Grouping(groups[1:].astype(np.int64), 0.5 * (numbers.max() > 0), names)
