"""The views of the page from a fitted filter and its pool."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from filtering.demo_filter import DemoFilter
from filtering.judging.explain import Clock, Finding, gravest
from filtering.report.layout import Mark
from filtering.report.page import DemoView, Segment
from filtering.vision.frames import frame_rate
from teasim.pool.clips import VideoWriter
from teasim.pool.source import Clip, Source


def demo_views(pool: Source, fitted: DemoFilter) -> list[DemoView]:
    """Return one view per demonstration, in the order of the pool.

    Raises:
        PoolError: a video is missing or damaged.
    """
    return [_view(pool, fitted, row) for row in range(len(pool.episodes))]


def _view(pool: Source, fitted: DemoFilter, row: int) -> DemoView:
    clock = Clock(pool.fps)
    spans = fitted.segments_.spans[row]
    flagged = bool(fitted.flagged_[row])
    episode = pool.episodes[row]
    clip = episode.clip(fitted.cameras_[0]) if fitted.cameras_ else None
    return DemoView(
        episode_index=episode.index,
        name=episode.name[:1].upper() + episode.name[1:] if clip else episode.name,
        demo_id=episode.demo_id,
        weight=float(fitted.weights_[row]),
        loss=float(fitted.losses_[row]),
        flagged=flagged,
        group=fitted.group_names_[fitted.groups_[row]] if fitted.group_names_ else "",
        reason=fitted.reasons_[row],
        seconds=clock.time(episode.length),
        segments=tuple(Segment(s.subtask, clock.time(s.start), clock.time(s.stop)) for s in spans),
        marks=marks_of(fitted.findings_[row], clock) if flagged else (),
        video=None if clip is None else _mp4_of(clip, frame_rate(pool)),
    )


def marks_of(findings: Sequence[Finding], clock: Clock) -> tuple[Mark, ...]:
    """Mark what is missing and the largest other findings; smaller ones follow from those."""
    if not findings:
        return ()
    grave = gravest(findings)
    return tuple(_mark(item, clock) for item in findings if item.missing or item in grave)


def _mark(finding: Finding, clock: Clock) -> Mark:
    if finding.ineffective is not None:
        text = f"{finding.ineffective.subtask} was ineffective"
    elif finding.expected is None:
        text = "the end was expected"
    else:
        text = f"{finding.expected} {'is missing' if finding.missing else 'expected'}"
    return Mark(clock.time(finding.frame), text)


def _mp4_of(clip: Clip, fps: float) -> bytes:
    """Return the clip as an mp4; formats that browsers do not play are encoded again."""
    stored = clip.mp4()
    if stored is not None:
        return stored
    height, width, _ = clip.frames([0])[0].shape
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        writer = VideoWriter(path, height=height, width=width, fps=fps)
        for image in clip.stream(np.arange(clip.length)):
            writer.add(image)
        writer.close()
        return path.read_bytes()
