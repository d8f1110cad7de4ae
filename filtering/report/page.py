"""The HTML page: it needs no network, and no file beside it but videos that are not embedded."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from filtering.report.layout import Mark, place_marks, strip_of
from teasim.common.errors import TeasimError
from teasim.common.figures.colours import colours_of, ink_on
from teasim.common.files import write_text
from teasim.pool.weight_table import COLUMNS


@dataclass(frozen=True)
class Segment:
    """A coloured segment of a timeline."""

    subtask: str
    """Its name."""
    start: float
    """Start [unit of the page]."""
    stop: float
    """End [unit of the page]."""


@dataclass(frozen=True)
class Truth:
    """What the labels of the pool say about a demonstration; the filter does not read it."""

    correct: bool
    """Whether it is labelled as correct."""
    mistakes: str
    """Its labelled mistakes in words."""


@dataclass(frozen=True)
class ExcerptView:
    """A stretch of a video that can be played."""

    episode_index: int
    """Number of the demonstration."""
    caption: str
    """Whose it is, and when."""
    start: float
    """Start [unit of the page]."""
    stop: float
    """End [unit of the page]."""
    stills: Mapping[str, tuple[str, ...]]
    """By camera the address of a picture of it, or of those before and after it."""


@dataclass(frozen=True)
class ExhibitView:
    """What is odd about a demonstration, there and as another demonstration has it."""

    title: str
    """What is odd, in a few words."""
    excerpts: tuple[ExcerptView, ...]
    """The stretch itself, and that of another demonstration."""
    camera: str = ""
    """Camera that shows it best; empty where none is better."""


@dataclass(frozen=True)
class DemoView:
    """What the page shows of one demonstration."""

    episode_index: int
    """Its number in the pool."""
    demo_id: str
    """Its identity."""
    weight: float
    """Weight in [0, 1]."""
    loss: float
    """Surprise [nats]."""
    flagged: bool
    """Whether it is flagged as incorrect."""
    group: str
    """What its group has in common, empty where only the weights define it."""
    reason: str
    """One sentence; empty for a kept demonstration that is usual."""
    seconds: float
    """Length of the video [unit of the page, seconds unless it says otherwise]."""
    segments: tuple[Segment, ...]
    """Its timeline."""
    marks: tuple[Mark, ...] = ()
    """Unusual places."""
    videos: Mapping[str, str] = field(default_factory=dict)
    """By camera the address of the mp4: a data URL or a path beside the page; empty for none."""
    stills: Mapping[str, str] = field(default_factory=dict)
    """By camera the address of a picture that is shown until the video is played."""
    name: str = ""
    """Heading; empty means its number."""
    group_number: int = 0
    """Number of its group, 0 is the best."""
    p_incorrect: float | None = None
    """Probability that it is incorrect; None where it is not known."""
    exhibits: tuple[ExhibitView, ...] = ()
    """What is odd about it, with pictures."""
    truth: Truth | None = None
    """What the labels of the pool say; None where there are none."""
    labels: tuple[Segment, ...] = ()
    """Labelled sub-tasks; empty where there are none, or they are its segments."""
    task: str = ""
    """Its task; empty where the pool does not name one."""
    task_number: int = 0
    """Number of its task where tasks were judged one by one, else 0."""

    @property
    def heading(self) -> str:
        """What a person calls it."""
        return self.name or f"Video {self.episode_index}"

    @property
    def group_text(self) -> str:
        """Its group in words."""
        return self.group or ("kept" if not self.flagged else f"group {self.group_number}")

    @property
    def camera(self) -> str:
        """Camera that is shown first."""
        best = next((item.camera for item in self.exhibits if item.camera), "")
        return best if best in self.videos else next(iter(self.videos), "")

    def row(self) -> list[str]:
        """Return its row of the weight table, as text."""
        p = "" if self.p_incorrect is None else repr(self.p_incorrect)
        numbers = [str(self.episode_index), repr(self.weight), repr(self.loss)]
        return [
            *(self.demo_id, *numbers, str(int(self.flagged))),
            *(str(self.group_number), self.reason, p, self.task),
        ]


@dataclass(frozen=True)
class ReportSection:
    """A part of the page that another package adds at its end."""

    title: str
    """Heading."""
    html: str
    """Trusted HTML, inserted without escaping."""


def render_report(
    path: Path | str,
    *,
    demos: Sequence[DemoView],
    threshold: float,
    subtasks: Sequence[str] = (),
    title: str = "Which demonstrations can be trusted?",
    summary: str = "",
    words: Sequence[str] = (),
    sections: Sequence[ReportSection] = (),
    unit: str = "s",
) -> None:
    """Write the page to `path`, atomically.

    Args:
        path: the HTML file, replaced if it is there.
        demos: the demonstrations, in any order.
        threshold: weight below which a demonstration is flagged; 0 when there is none.
        subtasks: names in the order of their colours; empty means in alphabetical order.
        title: heading of the page.
        summary: a line under the heading; empty means the number of flagged videos.
        words: sentences about the pool as a whole.
        sections: further sections.
        unit: unit of times, s or frames.

    Raises:
        TeasimError: the file cannot be written.
    """
    content = {
        "title": title,
        "summary": summary or _count_flagged(demos),
        "words": words,
        "threshold": threshold,
        "sections": sections,
        "unit": unit,
    }
    page = _environment().get_template("page.html.j2").render(content | _shown(demos, subtasks))
    try:
        write_text(Path(path), page)
    except OSError as error:
        raise TeasimError(f"The report '{path}' cannot be written: {error.strerror}.") from error


def _shown(demos: Sequence[DemoView], subtasks: Sequence[str]) -> dict[str, Any]:
    """Return what the template shows: demonstrations task by task, the lowest weight first."""
    ordered = sorted(demos, key=lambda demo: (demo.task_number, demo.weight, demo.episode_index))
    longest = max((demo.seconds for demo in demos), default=1.0) or 1.0
    names = list(subtasks) or sorted({part.subtask for demo in demos for part in demo.segments})
    by_group = sorted(demos, key=lambda demo: demo.group_number)
    return {
        "demos": ordered,
        "truth": _compared(demos),
        "colours": colours_of(names),
        "ink_on": ink_on,
        "longest": longest,
        "strip": strip_of([demo.weight for demo in ordered]),
        "tasks": {demo.task_number: demo.task for demo in ordered},
        "groups": list(dict.fromkeys(demo.group_text for demo in by_group)),
        "with_videos": any(demo.videos for demo in demos),
        "data": _data(ordered, names),
        "films": _films(ordered),
        "place_marks": lambda marks: place_marks(marks, longest),
    }


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("filtering.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["spoken"] = _spoken
    environment.filters["trusted"] = lambda html: Markup(html)
    environment.filters["percent"] = lambda share: f"{100 * share:.2f}".rstrip("0").rstrip(".")
    environment.filters["time"] = lambda time: f"{time:.3f}".rstrip("0").rstrip(".")
    return environment


def _data(demos: Sequence[DemoView], names: Sequence[str]) -> Markup:
    """Return what the script of the page works on, as JSON that is safe inside HTML."""
    content: dict[str, Any] = {
        "columns": COLUMNS,
        "rows": {demo.episode_index: demo.row() for demo in demos},
        "subtasks": [[name, _spoken(name)] for name in names],
    }
    return _json(content)


def _films(demos: Sequence[DemoView]) -> Markup:
    """Return the addresses of the videos; read when the first one is played."""
    return _json(
        {
            f"{demo.episode_index}/{camera}": address
            for demo in demos
            for camera, address in demo.videos.items()
        }
    )


def _json(content: Mapping[str, Any]) -> Markup:
    """Return JSON that is safe inside a script element."""
    return Markup(json.dumps(content, ensure_ascii=False).replace("<", "\\u003c"))


def _spoken(text: str) -> str:
    """Return the name of a sub-task as words."""
    return text.replace("_", " ")


def _count_flagged(demos: Sequence[DemoView]) -> str:
    flagged = sum(demo.flagged for demo in demos)
    if not flagged:
        return f"None of the {len(demos)} videos is flagged."
    verb = "is" if flagged == 1 else "are"
    return f"{flagged} of {len(demos)} videos {verb} flagged as incorrect."


def _compared(demos: Sequence[DemoView]) -> str:
    """Return how the flags agree with the labels of the pool; empty where there are none."""
    known = [demo for demo in demos if demo.truth]
    if not known:
        return ""
    wrong = [demo for demo in known if demo.truth and not demo.truth.correct]
    found = sum(demo.flagged for demo in wrong)
    false = sum(demo.flagged for demo in known) - found
    return (
        f"By the labels of the pool, {len(wrong)} of {len(known)} videos are incorrect: {found} of "
        f"them flagged, {len(wrong) - found} not flagged. Correct videos flagged: {false}."
    )
