"""The values a pool is made of: spans, mistakes, one demonstration's record, the header of all."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from teasim.common.errors import PoolError

NO_SUBTASK = -1
"""`subtask_index` of a frame that belongs to no sub-task."""

CAMERA_NAME = re.compile(r"[A-Za-z0-9_\-]+")


@dataclass(frozen=True)
class Span:
    """The frames `start <= frame < stop` in which a sub-task was carried out."""

    subtask: str
    """Name of the sub-task."""
    start: int
    """First frame."""
    stop: int
    """Frame after the last one."""

    def __post_init__(self) -> None:
        """Refuse an empty span."""
        _check_frames(self.subtask, self.start, self.stop, shortest=1)


@dataclass(frozen=True)
class MistakeSpan:
    """A mistake of kind `name` in `subtask`, in the frames `start <= frame < stop`.

    A skipped sub-task has `start == stop`: the frame at which it should have begun.
    """

    name: str
    """Kind of mistake."""
    subtask: str
    """Name of the sub-task."""
    start: int
    """First frame."""
    stop: int
    """Frame after the last one."""

    def __post_init__(self) -> None:
        """Refuse a span that ends before it starts."""
        _check_frames(f"{self.name} of {self.subtask}", self.start, self.stop, shortest=0)


@dataclass(frozen=True)
class GroundTruth:
    """What is known about a demonstration; for scoring only, never read by a filter."""

    sequence: str
    """Order of its sub-tasks: seq_1, seq_2, seq_3 (paper, section 4) or legal (any correct one)."""
    correct: bool
    """True when the goal is reached in a legal order without a mistake."""
    mistakes: tuple[MistakeSpan, ...]
    """Labelled mistakes in order of their first frame; empty when there are none."""
    participant: str | None
    """Who demonstrated it; None when that was not logged."""
    embodiment: str | None
    """yumi or person; None when that was not logged."""
    seed: int | None
    """Seed the demonstration was generated from; None when it was not generated."""


@dataclass(frozen=True)
class EpisodeRecord:
    """Everything a writer must say about one demonstration beside its frames."""

    sequence: str
    """Order of its sub-tasks: seq_1, seq_2, seq_3 or legal."""
    correct: bool
    """True when the goal is reached in a legal order without a mistake."""
    mistakes: tuple[MistakeSpan, ...]
    """Labelled mistakes in order of their first frame; empty when there are none."""
    spans: tuple[Span, ...]
    """Sub-task spans in order of time; they do not overlap."""
    participant: str
    """Who demonstrated it."""
    embodiment: str
    """yumi or person."""
    seed: int
    """Seed the demonstration was generated from."""
    task: str = "make a cup of tea"
    """The task as a sentence, LeRobot's task string."""

    def __post_init__(self) -> None:
        """Refuse spans that overlap."""
        for before, after in pairwise(self.spans):
            if after.start < before.stop:
                raise PoolError(
                    f"The spans of {before.subtask} (frames {before.start} to {before.stop}) and "
                    f"{after.subtask} (from frame {after.start}) overlap or are out of order."
                )


@dataclass(frozen=True)
class PoolHeader:
    """What all demonstrations of a pool have in common."""

    fps: int
    """Frames per second, also the rate of the joint log."""
    cameras: tuple[str, ...]
    """Short camera names, e.g. left and cup; empty for a pool that holds the joint log alone."""
    height: int
    """Height of a frame in pixels; even, as yuv420p needs it."""
    width: int
    """Width of a frame in pixels; even, as yuv420p needs it."""
    subtasks: tuple[str, ...]
    """Names of the sub-tasks in the order of `subtask_index`."""
    state_names: tuple[str, ...] | None
    """Names of the state and action dimensions; None for videos without a joint log."""
    environment_state_names: tuple[str, ...] | None
    """Names of the environment-state dimensions; None when it is not logged."""
    robot_type: str | None
    """LeRobot's robot type; None for people."""
    config: Mapping[str, Any] = field(default_factory=dict)
    """How the pool was generated; anything JSON can hold."""

    def __post_init__(self) -> None:
        """Refuse what no pool can be written with."""
        _check_numbers(self)
        _check_names(self)
        self.as_json()

    def as_json(self) -> dict[str, Any]:
        """The header as JSON holds it (tuples become lists).

        Raises:
            PoolError: `config` holds something JSON cannot.
        """
        values = {part.name: getattr(self, part.name) for part in fields(self)}
        values["config"] = dict(self.config)
        try:
            restored: dict[str, Any] = json.loads(json.dumps(values, allow_nan=False))
        except (TypeError, ValueError) as error:
            raise PoolError(f"The header's config cannot be written as JSON: {error}.") from error
        return restored


class Run(NamedTuple):
    """Frames start <= frame < stop with one label."""

    label: int
    """Label of its frames."""
    start: int
    """First frame."""
    stop: int
    """Frame after the last one."""

    @property
    def length(self) -> int:
        """Number of frames."""
        return self.stop - self.start


def runs(labels: np.ndarray) -> list[Run]:
    """Return the runs of equal labels (n,) in order of time; none for n = 0."""
    if not len(labels):
        return []
    edges = [0, *(np.flatnonzero(np.diff(labels)) + 1).tolist(), len(labels)]
    return [Run(int(labels[start]), start, stop) for start, stop in pairwise(edges)]


def spans_from_index(subtask_index: np.ndarray, subtasks: Sequence[str]) -> tuple[Span, ...]:
    """Runs of equal `subtask_index` (n,) as spans; frames without a sub-task belong to none.

    Raises:
        PoolError: An index has no name in `subtasks`.
    """
    spans = []
    for index, start, stop in runs(subtask_index):
        if index == NO_SUBTASK:
            continue
        if not 0 <= index < len(subtasks):
            raise PoolError(
                f"subtask_index is {index} at frame {start} but the pool names "
                f"{len(subtasks)} sub-tasks."
            )
        spans.append(Span(subtasks[index], start, stop))
    return tuple(spans)


def index_from_spans(spans: Sequence[Span], subtasks: Sequence[str], length: int) -> np.ndarray:
    """The column `subtask_index` (length,) int64 that belongs to `spans`.

    Raises:
        PoolError: A span leaves the demonstration or its sub-task is not in `subtasks`.
    """
    column = np.full(length, NO_SUBTASK, dtype=np.int64)
    for span in spans:
        if span.subtask not in subtasks:
            raise PoolError(
                f"'{span.subtask}' is no sub-task of this pool; choose {', '.join(subtasks)}."
            )
        if span.stop > length:
            raise PoolError(
                f"The span of {span.subtask} ends at frame {span.stop} but the demonstration "
                f"has {length} frames."
            )
        column[span.start : span.stop] = subtasks.index(span.subtask)
    return column


def _check_frames(what: str, start: int, stop: int, *, shortest: int) -> None:
    if start < 0 or stop - start < shortest:
        raise PoolError(f"The span of {what} runs from frame {start} to {stop}; that is no span.")


def _check_numbers(header: PoolHeader) -> None:
    if header.fps < 1:
        raise PoolError(f"fps is {header.fps}; a pool needs a whole number of 1 or more.")
    for name, pixels in (("height", header.height), ("width", header.width)):
        if pixels < 2 or pixels % 2:
            raise PoolError(f"The frame {name} is {pixels}; choose an even number of pixels.")


def _check_names(header: PoolHeader) -> None:
    if not header.cameras and header.state_names is None:
        raise PoolError("The header names neither a camera nor a joint log; a pool needs one.")
    for camera in header.cameras:
        if not CAMERA_NAME.fullmatch(camera):
            raise PoolError(
                f"'{camera}' is no camera name; use letters, digits, hyphen and underscore."
            )
    for field_name in ("cameras", "subtasks", "state_names", "environment_state_names"):
        names = getattr(header, field_name) or ()
        if len(set(names)) != len(names):
            raise PoolError(f"{field_name} holds a name twice: {', '.join(names)}.")
