"""What can be told about a source: facts as data, and the same facts as text of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from teasim.common.errors import PoolError
from teasim.pool.selection import tasks_of

if TYPE_CHECKING:
    from teasim.pool.source import Demonstration, Source

WIDTH = 80
"""Columns of the text, those of a terminal that nobody has resized."""
WIDEST_CELL = 19
"""Characters after which a cell is cut off; a demo_id has 19."""
MOST_TASKS = 10
"""Most tasks that the text names; a data set may have hundreds."""
UNKNOWN = "-"
"""What the text shows for a value that is not stored."""


@dataclass(frozen=True)
class DemonstrationFacts:
    """What is stored about one demonstration; None where it is not stored or damaged."""

    index: int
    """Number in the source."""
    demo_id: str | None
    """Stable identity."""
    frames: int
    """Number of frames."""
    seconds: float | None
    """Duration [s]."""
    sequence: str | None
    """Order of its sub-tasks: seq_1, seq_2, seq_3 or legal."""
    correct: bool | None
    """Whether it is labelled as correct."""
    participant: str | None
    """Who demonstrated it."""
    mistakes: tuple[dict[str, Any], ...] | None
    """Labelled mistakes: name, subtask, and the frames start (inclusive) to stop (exclusive)."""
    segments: tuple[dict[str, Any], ...] | None
    """Logged sub-tasks in order of time: subtask, and the frames start to stop."""


@dataclass(frozen=True)
class SourceFacts:
    """What is stored about a source; None where it is not stored or damaged."""

    cameras: tuple[str, ...]
    """Names of the cameras."""
    fps: float | None
    """Frames per second [1/s]."""
    tasks: dict[str, int] | None
    """Number of demonstrations of each task that is named."""
    subtasks: tuple[str, ...]
    """Names of the logged sub-tasks in the order of their numbers."""
    state_names: tuple[str, ...] | None
    """Names of the dimensions of the joint log."""
    content_hash: str | None
    """Hash of all that a filter may read."""
    demonstrations: tuple[DemonstrationFacts, ...]
    """The demonstrations in the order of their index."""


def facts_of(source: Source) -> SourceFacts:
    """Collect what is stored; values that damage hides are None."""
    return SourceFacts(
        cameras=source.cameras,
        fps=source.fps,
        tasks=_unless_damaged(lambda: _tasks(source)),
        subtasks=source.subtasks,
        state_names=getattr(source, "state_names", None),  # not every format has a joint log
        content_hash=_unless_damaged(source.content_hash),
        demonstrations=tuple(_demonstration(source, demo) for demo in source.episodes),
    )


def _tasks(source: Source) -> dict[str, int]:
    return {task: len(positions) for task, positions in tasks_of(source).items() if task}


def _demonstration(source: Source, demo: Demonstration) -> DemonstrationFacts:
    record = _unless_damaged(lambda: demo.record)
    spans = _unless_damaged(demo.spans)
    participant = _unless_damaged(lambda: getattr(demo, "participant", None))
    return DemonstrationFacts(
        index=demo.index,
        demo_id=_unless_damaged(lambda: demo.demo_id),
        frames=demo.length,
        seconds=None if source.fps is None else demo.length / source.fps,
        sequence=None if record is None else record.sequence,
        correct=None if record is None else record.correct,
        participant=participant,
        mistakes=None if record is None else tuple(asdict(m) for m in record.mistakes),
        segments=None if spans is None else tuple(asdict(span) for span in spans),
    )


def _unless_damaged(read: Callable[[], Any]) -> Any:
    """What `read` returns; None where damage, which a check reports, hides it."""
    try:
        return read()
    except PoolError:
        return None


def text_of(path: str, format_name: str, facts: SourceFacts) -> str:
    """Describe a source: a table of demonstrations, then what they have in common."""
    demonstrations = facts.demonstrations
    total = sum(demo.frames for demo in demonstrations)
    duration = f"{total} frames" if facts.fps is None else f"{total / facts.fps:.1f} s"
    joints = f"{len(facts.state_names)} dimensions" if facts.state_names else "none"
    names = ", ".join(f"{number}={name}" for number, name in enumerate(facts.subtasks))
    summary = {
        "Source": path,
        "Format": format_name,
        "Demonstrations": f"{len(demonstrations)}, {duration} in total",
        "Tasks": _named_tasks(facts.tasks or {}),
        "Cameras": ", ".join(facts.cameras) or "none",
        "Frame rate": "not stored" if facts.fps is None else f"{facts.fps:g} per second",
        "Joint log": joints,
        "Sub-tasks": names or "none logged",
        "Content hash": facts.content_hash or UNKNOWN,
    }
    width = max(map(len, summary)) + 2
    lines = [_hanging(f"{name}:".ljust(width), value) for name, value in summary.items()]
    return "\n".join([*_table(facts), "", *lines])


def _named_tasks(tasks: dict[str, int]) -> str:
    named = [f"'{task}' ({count})" for task, count in tasks.items()]
    more = [f"and {len(named) - MOST_TASKS} more"] if len(named) > MOST_TASKS else []
    return ", ".join(named[:MOST_TASKS] + more) or "none named"


def _table(facts: SourceFacts) -> Iterator[str]:
    """One row per demonstration; its mistakes stand on a line of their own below it."""
    unit = "frames" if facts.fps is None else "s"
    header = ["#", "demo_id", unit, "sequence", "correct", "participant"]
    rows = [header, *(_cells(demo) for demo in facts.demonstrations)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    last = ["sub-tasks", *(_numbers(facts, demo) for demo in facts.demonstrations)]
    for cells, numbers, position in zip(rows, last, range(-1, len(rows)), strict=False):
        start = "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True))
        yield _hanging(f"{start}  ", numbers)
        mistakes = facts.demonstrations[position].mistakes if position >= 0 else None
        if mistakes:
            told = ", ".join(f"{mistake['name']} {mistake['subtask']}" for mistake in mistakes)
            yield _hanging(f"{'':{widths[0]}}  mistakes: ", told)


def _cells(demo: DemonstrationFacts) -> list[str]:
    """The cells of a row but the last one."""
    correct = UNKNOWN if demo.correct is None else "yes" if demo.correct else "no"
    duration = str(demo.frames) if demo.seconds is None else f"{demo.seconds:.1f}"
    known = [demo.demo_id, duration, demo.sequence, correct, demo.participant]
    return [str(demo.index), *(_cut(cell or UNKNOWN) for cell in known)]


def _numbers(facts: SourceFacts, demo: DemonstrationFacts) -> str:
    """Numbers of the logged sub-tasks in order of time."""
    numbers = {name: str(number) for number, name in enumerate(facts.subtasks)}
    logged = demo.segments or ()
    return " ".join(numbers.get(span["subtask"], UNKNOWN) for span in logged) or UNKNOWN


def _cut(cell: str) -> str:
    return cell if len(cell) <= WIDEST_CELL else f"{cell[: WIDEST_CELL - 3]}..."


def _hanging(start: str, text: str) -> str:
    """`start` and `text`, wrapped so that later lines stand below the text; no word is broken."""
    return textwrap.fill(
        text,
        WIDTH,
        initial_indent=start,
        subsequent_indent=" " * len(start),
        break_long_words=False,
        break_on_hyphens=False,
    )


def json_of(facts: SourceFacts | None, **about: Any) -> dict[str, Any]:
    """Facts that `json.dumps` can write, after those in `about`; empty for an unreadable source."""
    return about | ({} if facts is None else asdict(facts))


def problem_count(problems: Sequence[str]) -> str:
    """Return the verdict of a check in words."""
    if not problems:
        return "sound"
    return f"damaged, {len(problems)} problem{'s' * (len(problems) > 1)}"
