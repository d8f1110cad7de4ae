"""Rows of numbers and texts as CSV, Parquet, Markdown and HTML."""

import csv
import io
import math
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from teasim.common.files import write_atomically, write_text

Rows = Sequence[Mapping[str, Any]]
"""Rows by their columns, which all have; None is an empty cell."""

STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:1200px;margin:2em auto;padding:0 1em}"
    "table{border-collapse:collapse;font-size:13px;display:block;overflow-x:auto}"
    "th,td{border:1px solid #ccc;padding:2px 8px;text-align:left;white-space:nowrap}"
    "th{vertical-align:bottom;white-space:normal}summary{cursor:pointer;padding:.4em 0}"
    "pre{background:#f4f4f4;padding:.5em;overflow-x:auto}"
    "figure{display:inline-block;margin:0 1em 1em 0}figure img{max-width:min(540px,100%)}"
    "figcaption{font-size:12px;color:#56616a}"
)
"""CSS of a page."""


def csv_text(rows: Rows) -> str:
    """Write rows as CSV."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows({name: _plain(value) for name, value in row.items()} for row in rows)
    return text.getvalue()


def write_rows(folder: Path, name: str, rows: Rows) -> None:
    """Write NAME.csv and NAME.parquet; the same rows give the same bytes."""
    write_text(folder / f"{name}.csv", csv_text(rows))
    table = pa.Table.from_pylist([dict(row) for row in rows])
    write_atomically(folder / f"{name}.parquet", lambda path: pq.write_table(table, path))


def markdown_table(rows: Rows) -> str:
    """Write rows as a table; empty without rows."""
    if not rows:
        return ""
    lines = [list(rows[0]), ["---"] * len(rows[0])]
    lines += [[cell(value) for value in row.values()] for row in rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def html_table(rows: Rows) -> str:
    """Write rows as a table; empty without rows."""
    if not rows:
        return ""
    heads = "".join(f"<th>{escape(column)}</th>" for column in rows[0])
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell(value))}</td>" for value in row.values()) + "</tr>"
        for row in rows
    )
    return f"<table><tr>{heads}</tr>{body}</table>"


def html_page(title: str, parts: Sequence[str]) -> str:
    """Write a page of its own around `parts`, which are HTML."""
    head = (
        f"<!doctype html><html lang='en'><meta charset='utf-8'><title>{escape(title)}</title>"
        f"<meta name='viewport' content='width=device-width'><style>{STYLE}</style>"
        f"<h1>{escape(title)}</h1>"
    )
    return "\n".join([head, *parts, "</html>\n"])


def cell(value: Any) -> str:
    """Write a value as in a table that is read, with at most three decimals."""
    if isinstance(value, float) and math.isnan(value):
        return ""
    if isinstance(value, float):
        return f"{value:.3f}".rstrip("0").rstrip(".")
    return "" if value is None else str(value)


def _plain(value: Any) -> Any:
    """Return what CSV shows of a value: shares and losses to six decimals, nothing for nan."""
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6f}".rstrip("0").rstrip(".")
    return value
