"""The HTML page: it needs no network, and no file beside it but videos that are too large."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from filtering.report.layout import Dot, Mark, place_dots, place_marks
from teasim.common.errors import TeasimError
from teasim.common.files import write_text

PALETTE = (
    "#d9822b",
    "#4c86c6",
    "#c9b458",
    "#8d7bb8",
    "#5a9e6f",
    "#b86b8f",
    "#5b6770",
    "#9a6b4f",
    "#3fa7a0",
    "#7d8f3a",
)
"""Colours of the first sub-tasks in their order."""
GOLDEN_ANGLE = 137.508
"""Further colours are this far apart on the colour wheel [degrees]."""


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
    video: str | None = None
    """Address of the mp4 that is shown: a data URL or a path beside the page; None for none."""
    name: str = ""
    """Heading; empty means its number."""


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
        sections: further sections.
        unit: unit of times, s or frames.

    Raises:
        TeasimError: the file cannot be written.
    """
    ordered = sorted(demos, key=lambda demo: (demo.weight, demo.episode_index))
    longest = max((demo.seconds for demo in demos), default=1.0) or 1.0
    page = (
        _environment()
        .get_template("page.html.j2")
        .render(
            title=title,
            summary=summary or _count_flagged(demos),
            demos=ordered,
            threshold=threshold,
            colours=_colours(demos, subtasks),
            longest=longest,
            dots=_dots(ordered),
            sections=sections,
            unit=unit,
            with_videos=any(demo.video for demo in demos),
            place_marks=lambda marks: place_marks(marks, longest),
        )
    )
    try:
        write_text(Path(path), page)
    except OSError as error:
        raise TeasimError(f"The report '{path}' cannot be written: {error.strerror}.") from error


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
    return environment


def _colours(demos: Sequence[DemoView], subtasks: Sequence[str]) -> dict[str, str]:
    names = list(subtasks) or sorted({part.subtask for demo in demos for part in demo.segments})
    return {name: _colour(number) for number, name in enumerate(names)}


def _colour(number: int) -> str:
    if number < len(PALETTE):
        return PALETTE[number]
    return f"hsl({GOLDEN_ANGLE * number % 360:.0f} 38% {(44, 56)[number % 2]}%)"


def _spoken(text: str) -> str:
    """Return the name of a sub-task as words."""
    return text.replace("_", " ")


def _count_flagged(demos: Sequence[DemoView]) -> str:
    flagged = sum(demo.flagged for demo in demos)
    if not flagged:
        return f"None of the {len(demos)} videos is flagged."
    verb = "is" if flagged == 1 else "are"
    return f"{flagged} of {len(demos)} videos {verb} flagged as incorrect."


def _dots(demos: Sequence[DemoView]) -> list[tuple[DemoView, Dot]]:
    return list(zip(demos, place_dots([demo.weight for demo in demos]), strict=True))
