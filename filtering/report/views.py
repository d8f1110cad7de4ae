"""The views of the page from a fitted filter and its pool."""

from collections.abc import Sequence
from pathlib import Path

from filtering.demo_filter import DemoFilter
from filtering.judging.explain import Clock, Finding, gravest
from filtering.report.layout import Mark
from filtering.report.page import DemoView, Segment
from filtering.report.videos import page_videos
from filtering.vision.frames import frame_rate
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool.source import Source


def demo_views(
    pool: Source, fitted: DemoFilter, beside: Path, *, workers: Workers = IN_PROCESS
) -> list[DemoView]:
    """Return one view per demonstration, in the order of the pool.

    Args:
        pool: what was filtered.
        fitted: the filter after `fit(pool)`.
        beside: folder of the page, where videos are written that are too large to embed.
        workers: where the work runs; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged.
    """
    videos = {}
    if fitted.cameras_:
        clips = {episode.index: episode.clip(fitted.cameras_[0]) for episode in pool.episodes}
        videos = page_videos(clips, frame_rate(pool), beside, workers=workers)
    return [
        _view(pool, fitted, row, videos.get(episode.index))
        for row, episode in enumerate(pool.episodes)
    ]


def _view(pool: Source, fitted: DemoFilter, row: int, video: str | None) -> DemoView:
    clock = Clock(pool.fps)
    spans = fitted.segments_.spans[row]
    flagged = bool(fitted.flagged_[row])
    episode = pool.episodes[row]
    return DemoView(
        episode_index=episode.index,
        name=episode.name[:1].upper() + episode.name[1:] if video else episode.name,
        demo_id=episode.demo_id,
        weight=float(fitted.weights_[row]),
        loss=float(fitted.losses_[row]),
        flagged=flagged,
        group=fitted.group_names_[fitted.groups_[row]] if fitted.group_names_ else "",
        reason=fitted.reasons_[row],
        seconds=clock.time(episode.length),
        segments=tuple(Segment(s.subtask, clock.time(s.start), clock.time(s.stop)) for s in spans),
        marks=marks_of(fitted.findings_[row], clock) if fitted.reasons_[row] else (),
        video=video,
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
    elif finding.extra is not None:
        text = f"{finding.extra.subtask} is extra"
    elif finding.expected is None:
        text = "the end was expected"
    else:
        text = f"{finding.expected} {'is missing' if finding.missing else 'expected'}"
    return Mark(clock.time(finding.frame), text)
