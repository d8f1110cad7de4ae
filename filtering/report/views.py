"""From a fitted filter and its pool to what the page shows."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from filtering.demo_filter import DemoFilter
from filtering.explain import Finding, gravest
from filtering.report.layout import Mark
from filtering.report.page import DemoView, Segment
from teasim.pool import Episode, Pool, VideoClip, read_frames
from teasim.pool.videos import VideoWriter, video_content


def demo_views(pool: Pool, fitted: DemoFilter) -> list[DemoView]:
    """Return one view per demonstration, in the order of the pool.

    Raises:
        PoolError: a video is missing or damaged.
    """
    camera = fitted.cameras_[0]
    return [_view(pool, fitted, row, episode, camera) for row, episode in enumerate(pool.episodes)]


def _view(pool: Pool, fitted: DemoFilter, row: int, episode: Episode, camera: str) -> DemoView:
    fps = pool.fps
    spans = fitted.segments_.spans[row]
    flagged = bool(fitted.flagged_[row])
    return DemoView(
        episode_index=episode.index,
        demo_id=episode.demo_id,
        weight=float(fitted.weights_[row]),
        loss=float(fitted.losses_[row]),
        flagged=flagged,
        group=int(fitted.groups_[row]),
        reason=fitted.reasons_[row],
        seconds=episode.length / fps,
        segments=tuple(Segment(s.subtask, s.start / fps, s.stop / fps) for s in spans),
        marks=_marks(fitted.findings_[row], fps) if flagged else (),
        video=_mp4_of(episode.video(camera), fps),
    )


def _marks(findings: Sequence[Finding], fps: float) -> tuple[Mark, ...]:
    """Mark what is missing and the gravest of the rest; echoes of those would only confuse."""
    grave = gravest(findings)
    return tuple(_mark(item, fps) for item in findings if item.missing or item in grave)


def _mark(finding: Finding, fps: float) -> Mark:
    if finding.expected is None:
        text = "the end was expected"
    else:
        text = f"{finding.expected} {'is missing' if finding.missing else 'expected'}"
    return Mark(finding.frame / fps, text)


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
