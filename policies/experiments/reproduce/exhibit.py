"""What a table or figure of the paper becomes here: units of work, then rows and sentences."""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import Any

from policies.experiments.reproduce.plan import Plan
from policies.experiments.units import Store, Unit

Row = Mapping[str, Any]
"""A row by its columns; None is an empty cell."""


@dataclass(frozen=True)
class Table:
    """The data of a table or figure."""

    rows: Sequence[Row]
    """The rows; all have the same columns."""
    words: Sequence[str]
    """Sentences on what differs from the paper, computed from the rows."""
    not_run: str = ""
    """Why nothing was run; empty where something was."""
    notes: Sequence[str] = field(default_factory=tuple)
    """How the numbers are to be read."""

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self.rows[0]) if self.rows else []


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


def as_csv(table: Table) -> str:
    """Write the rows as CSV; shares and probabilities with all their digits."""
    text = io.StringIO()
    writer = csv.DictWriter(text, table.columns, lineterminator="\n")
    writer.writeheader()
    writer.writerows(table.rows)
    return text.getvalue()


def as_markdown(name: str, exhibit: Exhibit, table: Table, command: str) -> str:
    """Write a section: the command, what the paper says, sentences, and the rows."""
    parts = [f"## {name}: {exhibit.title}", f"    {command}", f"The paper: {exhibit.paper}"]
    if table.not_run:
        return "\n\n".join([*parts, f"Not run: {table.not_run}"]) + "\n"
    parts += ["\n".join(f"* {sentence}" for sentence in table.words)] if table.words else []
    lines = [table.columns, ["---"] * len(table.columns)]
    lines += [[_cell(value) for value in row.values()] for row in table.rows]
    parts.append("\n".join(f"| {' | '.join(line)} |" for line in lines))
    return "\n\n".join([*parts, *table.notes]) + "\n"


def as_html(name: str, exhibit: Exhibit, table: Table, command: str) -> str:
    """Write the same section as HTML."""
    head = f"<section id='{escape(name)}'><h2>{escape(name)}: {escape(exhibit.title)}</h2>"
    parts = [head, f"<pre>{escape(command)}</pre>", f"<p>The paper: {escape(exhibit.paper)}</p>"]
    if table.not_run:
        return "\n".join([*parts, f"<p>Not run: {escape(table.not_run)}</p></section>"])
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in table.words)
    heads = "".join(f"<th>{escape(column)}</th>" for column in table.columns)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(_cell(value))}</td>" for value in row.values()) + "</tr>"
        for row in table.rows
    )
    notes = "".join(f"<p>{escape(note)}</p>" for note in table.notes)
    parts += [f"<ul>{items}</ul>", f"<table><tr>{heads}</tr>{rows}</table>", notes, "</section>"]
    return "\n".join(parts)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return "" if value != value else f"{value:.3f}".rstrip("0").rstrip(".")
    return str(value)
