"""The views of the page from a fitted filter and its pool."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from filtering.demo_filter import DemoFilter
from filtering.judging.explain import Clock, Finding
from filtering.report.exhibits import Excerpt, Exhibit, exhibits_of, shown
from filtering.report.layout import Mark
from filtering.report.page import DemoView, ExcerptView, ExhibitView, Segment, Truth
from filtering.report.videos import Embed, Film, Key, Wanted, page_films
from filtering.vision.frames import frame_rate
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool import Span
from teasim.pool.selection import task_line
from teasim.pool.source import Demonstration, Source


def demo_views(
    pool: Source,
    fitted: DemoFilter,
    beside: Path,
    *,
    embed: Embed = "auto",
    workers: Workers = IN_PROCESS,
) -> list[DemoView]:
    """Return one view per demonstration, in the order of the pool.

    Labels of correctness are only repeated, where they are known.

    Args:
        pool: what was filtered.
        fitted: the filter after `fit(pool)`.
        beside: folder of the page, where videos are written that are not embedded.
        embed: whether videos are embedded.
        workers: where the work runs; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged.
    """
    exhibits = [
        exhibits_of(pool, fitted, demo) if flagged else ()
        for demo, flagged in enumerate(fitted.flagged_)
    ]
    films: dict[Key, Film] = {}
    if fitted.cameras_:
        wanted = _wanted(pool, fitted.cameras_[0], exhibits)
        films = page_films(wanted, frame_rate(pool), beside, embed, workers=workers)
    return [_view(pool, fitted, demo, own, films) for demo, own in enumerate(exhibits)]


def _wanted(pool: Source, main: str, exhibits: Sequence[Sequence[Exhibit]]) -> dict[Key, Wanted]:
    """Return the videos of the page: one camera of each demonstration, all of those compared."""
    frames = {demo: {episode.length // 2} for demo, episode in enumerate(pool.episodes)}
    compared = [each for own in exhibits for item in own for each in (item.own, item.other) if each]
    for excerpt in compared:
        frames[excerpt.demo].update(excerpt.frames)
    several = {excerpt.demo for excerpt in compared}
    return {
        (episode.index, number): Wanted(episode.clip(camera), tuple(sorted(frames[demo])))
        for demo, episode in enumerate(pool.episodes)
        for number, camera in enumerate(pool.cameras)
        if camera == main or demo in several
    }


def _view(
    pool: Source,
    fitted: DemoFilter,
    demo: int,
    exhibits: Sequence[Exhibit],
    films: Mapping[Key, Film],
) -> DemoView:
    clock, episode = Clock(pool.fps), pool.episodes[demo]
    own = {pool.cameras[n]: film for (index, n), film in films.items() if index == episode.index}
    logged = () if fitted.chosen_.segmenter == "logged" else _segments(episode.spans(), clock)
    return DemoView(
        episode_index=episode.index,
        name=_capital(episode.name) if own else episode.name,
        demo_id=episode.demo_id,
        weight=float(fitted.weights_[demo]),
        loss=float(fitted.losses_[demo]),
        p_incorrect=float(fitted.probabilities_[demo]),
        flagged=bool(fitted.flagged_[demo]),
        group=fitted.group_names_[fitted.groups_[demo]] if fitted.group_names_ else "",
        group_number=int(fitted.groups_[demo]),
        reason=fitted.reasons_[demo],
        seconds=clock.time(episode.length),
        segments=_segments(fitted.segments_.spans[demo], clock),
        marks=marks_of(fitted.findings_[demo], clock) if fitted.reasons_[demo] else (),
        videos={camera: film.video for camera, film in own.items()},
        stills={camera: film.stills[episode.length // 2] for camera, film in own.items()},
        exhibits=tuple(_exhibit_view(pool, item, films) for item in exhibits) if own else (),
        truth=_truth(episode, clock),
        labels=logged,
        task=task_line(episode),
        task_number=next((n for n, t in enumerate(fitted.tasks_) if demo in t.rows), 0),
    )


def _segments(spans: Iterable[Span], clock: Clock) -> tuple[Segment, ...]:
    return tuple(Segment(s.subtask, clock.time(s.start), clock.time(s.stop)) for s in spans)


def _exhibit_view(pool: Source, exhibit: Exhibit, films: Mapping[Key, Film]) -> ExhibitView:
    clock, finding = Clock(pool.fps), exhibit.finding
    where = f"expected at {clock.at(finding.frame)}"
    if finding.ineffective or finding.came or finding.extra:
        where = clock.during(exhibit.own.span)
    elif not finding.missing:
        where = f"from {clock.at(finding.frame)}"
    excerpts = [_excerpt_view(pool, exhibit.own, f"Here, {where}", films)]
    if exhibit.other is not None:
        model = pool.episodes[exhibit.other.demo].name
        when = clock.during(exhibit.other.span)
        excerpts.append(_excerpt_view(pool, exhibit.other, f"{_capital(model)}, {when}", films))
    camera = finding.counterpart.camera if finding.counterpart else ""
    return ExhibitView(_words(finding), tuple(excerpts), camera)


def _excerpt_view(
    pool: Source, excerpt: Excerpt, caption: str, films: Mapping[Key, Film]
) -> ExcerptView:
    clock, index = Clock(pool.fps), pool.episodes[excerpt.demo].index
    return ExcerptView(
        episode_index=index,
        caption=caption,
        start=clock.time(excerpt.span.start),
        stop=clock.time(excerpt.span.stop),
        stills={
            camera: tuple(films[index, number].stills[frame] for frame in excerpt.frames)
            for number, camera in enumerate(pool.cameras)
        },
    )


def _truth(episode: Demonstration, clock: Clock) -> Truth | None:
    """Return what the labels of the pool say; None where nothing is known."""
    if episode.record is None:
        return None
    mistakes = [
        f"{m.name.replace('_', ' ')} of {m.subtask} at {clock.at(m.start)}"
        for m in episode.record.mistakes
    ]
    return Truth(episode.record.correct, ", ".join(mistakes))


def _capital(name: str) -> str:
    return name[:1].upper() + name[1:]


def marks_of(findings: Sequence[Finding], clock: Clock) -> tuple[Mark, ...]:
    """Mark what is missing and the largest other findings; smaller ones follow from those."""
    return tuple(Mark(clock.time(item.frame), _brief(item)) for item in shown(findings))


def _brief(finding: Finding) -> str:
    """Return the text of a mark; a moment has no name, and its place in another video is long."""
    if finding.counterpart is None:
        return _words(finding)
    if finding.ineffective is not None:
        return "without effect"
    if finding.came is not None:
        return "at an unusual place"
    return "something is missing" if finding.missing else "few others show this"


def _words(finding: Finding) -> str:
    if finding.ineffective is not None:
        return f"{finding.ineffective.subtask} was ineffective"
    if finding.extra is not None:
        return f"{finding.extra.subtask} is extra"
    if finding.expected is None:
        return "the end was expected" if finding.counterpart is None else "few others show this"
    return f"{finding.expected} {'is missing' if finding.missing else 'expected'}"
