"""From a fitted filter and its pool to what the page shows."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from filtering.demo_filter import DemoFilter
from filtering.judging.explain import Clock, Finding, gravest
from filtering.report.layout import Mark
from filtering.report.page import DemoView, Segment
from teasim.pool import VideoClip, read_frames
from teasim.pool.sequences import SequencePool, Source
from teasim.pool.videos import VideoWriter, video_content


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
    if isinstance(pool, SequencePool):
        name, length, video = pool.episodes[row].demo_id, spans[-1].stop, None
    else:
        episode = pool.episodes[row]
        name, length = f"Video {episode.index}", episode.length
        video = _mp4_of(episode.video(fitted.cameras_[0]), pool.fps)
    return DemoView(
        episode_index=pool.episodes[row].index,
        name=name,
        demo_id=pool.episodes[row].demo_id,
        weight=float(fitted.weights_[row]),
        loss=float(fitted.losses_[row]),
        flagged=flagged,
        group=fitted.group_names_[fitted.groups_[row]] if fitted.group_names_ else "",
        reason=fitted.reasons_[row],
        seconds=clock.time(length),
        segments=tuple(Segment(s.subtask, clock.time(s.start), clock.time(s.stop)) for s in spans),
        marks=marks_of(fitted.findings_[row], clock) if flagged else (),
        video=video,
    )


def marks_of(findings: Sequence[Finding], clock: Clock) -> tuple[Mark, ...]:
    """Mark what is missing and the gravest of the rest; echoes of those would only confuse."""
    if not findings:
        return ()
    grave = gravest(findings)
    return tuple(_mark(item, clock) for item in findings if item.missing or item in grave)


def _mark(finding: Finding, clock: Clock) -> Mark:
    if finding.idle is not None:
        text = f"nothing came of {finding.idle.subtask}"
    elif finding.expected is None:
        text = "the end was expected"
    else:
        text = f"{finding.expected} {'is missing' if finding.missing else 'expected'}"
    return Mark(clock.time(finding.frame), text)


def _mp4_of(clip: VideoClip, fps: float) -> bytes:
    """Return the clip as an mp4 of its own; a file that holds more is cut by encoding anew."""
    if clip.start_frame == 0 and video_content(clip.path).n_frames == clip.length:
        return clip.path.read_bytes()
    frames = read_frames(clip, np.arange(clip.length))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "clip.mp4"
        writer = VideoWriter(path, height=frames.shape[1], width=frames.shape[2], fps=round(fps))
        for image in frames:
            writer.add(image)
        writer.close()
        return path.read_bytes()
