"""What is written: demonstrations of a source with their labels and verdicts, in any format."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from teasim.common.errors import ConfigError
from teasim.pool.segments_table import SegmentRow, spans_by_demonstration
from teasim.pool.source import Demonstration, Source
from teasim.pool.types import Span
from teasim.pool.weight_table import WeightRow, match_rows
from teasim.pool.writers.subtask_names import check_names, listed, renamed


@dataclass(frozen=True)
class Item:
    """One demonstration that is written."""

    number: int
    """Its number in what is written, counted from 0."""
    demo: Demonstration
    """Its pictures, logs and facts."""
    spans: tuple[Span, ...]
    """Its sub-task spans in frames of the source."""
    verdict: WeightRow | None = None
    """What a filter says about it; None when nothing is said."""


@dataclass(frozen=True)
class Content:
    """What is written, whatever the format."""

    root: Path
    """The source, which is not modified."""
    fps: float | None
    """Frames per second of the source; None where it is not known."""
    cameras: tuple[str, ...]
    """Cameras whose pictures are written."""
    logs: Mapping[str, tuple[str, ...]]
    """Names of the dimensions of each log."""
    subtasks: tuple[str, ...]
    """Names of the sub-tasks; empty without labels."""
    items: tuple[Item, ...]
    """The demonstrations in their order."""
    found: bool = False
    """Whether the spans were found by a segmenter, not logged or named by a person."""
    language: bool = False
    """Whether LeRobot data sets also get the sub-tasks as sentences (language_persistent)."""

    @property
    def judged(self) -> bool:
        """Whether there are verdicts."""
        return any(item.verdict is not None for item in self.items)

    def common(self) -> Self:
        """Return the content without its demonstrations, to hand to a worker process."""
        return replace(self, items=())

    def fingerprint(self, source: Source) -> str:
        """Return a hash of everything that decides what is written.

        Raises:
            PoolError: a file of the source is missing or damaged.
        """
        told = {name: value for name, value in vars(self).items() if name not in ("items", "root")}
        parts = [json.dumps(told, default=dict), source.content_hash()]
        for item in self.items:
            demo, verdict = item.demo, item.verdict
            facts: list[Any] = [item.number, demo.demo_id, demo.task, repr(demo.record)]
            facts += [[asdict(span) for span in item.spans], verdict and asdict(verdict)]
            parts.append(json.dumps(facts))
        return hashlib.sha256("\n".join(parts).encode()).hexdigest()


@dataclass(frozen=True)
class Choice:
    """What of a source is written, and what is added to it."""

    cameras: tuple[str, ...] = ()
    """Cameras whose pictures are written; empty means all."""
    weights: tuple[WeightRow, ...] | None = None
    """The weight table; None without verdicts."""
    segments: tuple[SegmentRow, ...] | None = None
    """The table of segments, which replaces logged sub-tasks; None keeps those."""
    names: Mapping[str, str] | None = None
    """New names of sub-tasks by the old ones."""
    drop_flagged: bool = False
    """Leave out the demonstrations that the weight table flags."""
    language: bool = False
    """Whether LeRobot data sets also get the sub-tasks as sentences."""


def content_of(source: Source, choice: Choice) -> Content:
    """Return what of a source is to be written.

    Raises:
        ConfigError: a camera or name is unknown, a table is about other demonstrations, or nothing
            is left.
        PoolError: the source is damaged.
    """
    demos = list(source.episodes)
    cameras = choice.cameras or source.cameras
    for camera in cameras:
        if camera not in source.cameras:
            known = ", ".join(source.cameras) or "none"
            raise ConfigError(f"'{source.root}' has no camera '{camera}'; it has {known}.")
    spans, subtasks = _labels(source, demos, choice)
    verdicts = _verdicts(source, demos, choice)
    kept = [
        place
        for place, verdict in enumerate(verdicts)
        if not (choice.drop_flagged and verdict is not None and verdict.flagged)
    ]
    if not kept:
        raise ConfigError(f"All demonstrations of '{source.root}' are flagged; nothing is left.")
    items = tuple(
        Item(number, demos[place], spans[place], verdicts[place])
        for number, place in enumerate(kept)
    )
    found = choice.segments is not None and choice.names is None
    logs = dict(source.logs)
    return Content(source.root, source.fps, cameras, logs, subtasks, items, found, choice.language)


def sampled(length: int, fps: float, rate: float) -> np.ndarray:
    """Return which frame is shown at each time of another rate, (m,) ascending.

    Args:
        length: number of frames.
        fps: frames per second that there are.
        rate: frames per second that are wanted.
    """
    if fps == rate:
        return np.arange(length)
    last = int((length - 1) * rate / fps + 0.25)
    times = np.arange(last + 1) * fps / rate
    return np.minimum((times + 0.5).astype(np.int64), length - 1)


def sampled_spans(spans: Sequence[Span], frames: np.ndarray) -> tuple[Span, ...]:
    """Return spans in terms of the places in `frames`; those that none shows are gone."""
    edges = [
        (span.subtask, *np.searchsorted(frames, [span.start, span.stop]).tolist()) for span in spans
    ]
    return tuple(Span(name, start, stop) for name, start, stop in edges if start < stop)


def _labels(
    source: Source, demos: Sequence[Demonstration], choice: Choice
) -> tuple[list[tuple[Span, ...]], tuple[str, ...]]:
    """Return the spans of each demonstration and the names of all sub-tasks."""
    if choice.segments is None:
        spans, known = [demo.spans() for demo in demos], source.subtasks
    else:
        told = spans_by_demonstration(choice.segments, demos)
        if not any(told):
            raise ConfigError(
                f"The table of segments is about other demonstrations than those of "
                f"'{source.root}'; name the one that teasim filter wrote for this source."
            )
        spans = [own or () for own in told]
        known = listed(spans)
    names = choice.names or {}
    check_names(names, known)
    spans = [renamed(own, names) for own in spans] if names else spans
    given = (*names.values(), *(names.get(name, name) for name in known))
    return spans, tuple(dict.fromkeys(given))


def _verdicts(
    source: Source, demos: Sequence[Demonstration], choice: Choice
) -> list[WeightRow | None]:
    if choice.weights is None:
        if choice.drop_flagged:
            raise ConfigError("--drop-flagged needs the weight table; add --weights FILE.")
        return [None] * len(demos)
    rows = match_rows(choice.weights, [demo.demo_id for demo in demos])
    missing = [demo.name for demo, row in zip(demos, rows, strict=True) if row is None]
    if missing:
        raise ConfigError(
            f"The weight table does not know '{missing[0]}' of '{source.root}'; name the one that "
            "teasim filter wrote for this source."
        )
    return rows
