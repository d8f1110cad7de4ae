"""What a table or figure of the paper becomes here: units of work, then rows and sentences."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from policies.experiments.reproduce.plan import Plan
from policies.experiments.tabular import Rows, html_table, markdown_table
from policies.experiments.units import Store, Unit
from teasim.common.figures import Drawing

MOST_OPEN = 20
"""Most rows of a table that a page shows before it is asked to."""


@dataclass(frozen=True)
class Table:
    """The data of a table or figure."""

    rows: Rows
    """The rows; all have the same columns."""
    words: Sequence[str]
    """Sentences on what differs from the paper, computed from the rows."""
    not_run: str = ""
    """Why nothing was run; empty where something was."""
    notes: Sequence[str] = ()
    """How the numbers are to be read."""

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self.rows[0]) if self.rows else []


def no_figures(plan: Plan, store: Store) -> Mapping[str, Drawing]:
    """Draw nothing."""
    del plan, store
    return {}


@dataclass(frozen=True)
class Exhibit:
    """A table or figure of the paper."""

    title: str
    """What it shows."""
    paper: str
    """What the paper says there, in a sentence."""
    units: Callable[[Plan], Sequence[Unit]]
    """Returns the work it is made from."""
    table: Callable[[Plan, Store], Table]
    """Returns the table, when all units are done."""
    figures: Callable[[Plan, Store], Mapping[str, Drawing]] = no_figures
    """Returns figures by file name, when all units are done."""


def as_markdown(name: str, exhibit: Exhibit, table: Table, command: str) -> str:
    """Write a section: the command, what the paper says, sentences, and the rows."""
    parts = [f"## {name}: {exhibit.title}", f"    {command}", f"The paper: {exhibit.paper}"]
    if table.not_run:
        return "\n\n".join([*parts, f"Not run: {table.not_run}"]) + "\n"
    parts += ["\n".join(f"* {sentence}" for sentence in table.words), markdown_table(table.rows)]
    return "\n\n".join([*parts, *table.notes]) + "\n"


def as_html(
    name: str, exhibit: Exhibit, table: Table, command: str, *, figures: Sequence[str] = ()
) -> str:
    """Write the same section as HTML, with the `figures` that are drawn, files beside the page."""
    head = f"<section id='{escape(name)}'><h2>{escape(name)}: {escape(exhibit.title)}</h2>"
    parts = [head, f"<pre>{escape(command)}</pre>", f"<p>The paper: {escape(exhibit.paper)}</p>"]
    if table.not_run:
        return "\n".join([*parts, f"<p>Not run: {escape(table.not_run)}</p></section>"])
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in table.words)
    notes = "".join(f"<p>{escape(note)}</p>" for note in table.notes)
    pictures = "".join(
        f"<figure><img src='{escape(path)}' alt='{escape(Path(path).stem)}' loading='lazy'>"
        f"<figcaption>{escape(Path(path).stem)}</figcaption></figure>"
        for path in figures
    )
    parts += [f"<ul>{items}</ul>", pictures, _folded(table.rows), notes]
    return "\n".join([*parts, "</section>"])


def _folded(rows: Rows) -> str:
    """Write rows as a table in HTML, folded if it is long."""
    if len(rows) <= MOST_OPEN:
        return html_table(rows)
    return f"<details><summary>All {len(rows)} rows</summary>{html_table(rows)}</details>"
