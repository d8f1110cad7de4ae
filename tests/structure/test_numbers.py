"""Numbers that were measured stand beside the command that repeats them."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
TEXTS = ("README.md", "docs/policies.md", "docs/results.md", "docs/reproduce.md")
"""Texts whose tables are checked."""
COMMAND = re.compile(
    r"^(?: {4,}|\s*)(?:\.venv/bin/)?(?:teasim [a-z]|python (?:scripts/|-m )|scripts/)", re.MULTILINE
)
"""A line of code that runs something."""
MEASURED = re.compile(r"\d[\d.,]*(?: %| of \d| ms| s\b| mm| m/s)|(?<![\w.])\d?\.\d+")
"""A number that looks measured: with a unit or a decimal point."""


def sections(text: str) -> dict[str, str]:
    """Return the text below each heading of the second and third level, by the heading.

    A heading of the third level also has what its heading of the second level says before any.
    """
    found: dict[str, str] = {}
    for chapter in re.split(r"^(?=## )", text, flags=re.MULTILINE)[1:]:
        first, *others = re.split(r"^(?=### )", chapter, flags=re.MULTILINE)
        for part in (first, *others):
            title = part.splitlines()[0].lstrip("# ")
            found[title] = part if part is first else f"{first}\n{part}"
    return found


def without_command(text: str) -> list[str]:
    """Return the sections that have a measured number in a table but no command."""
    return [
        title
        for title, part in sections(text).items()
        if any(MEASURED.search(line) for line in part.splitlines() if line.startswith("|"))
        and not COMMAND.search(part)
    ]


@pytest.mark.parametrize("name", TEXTS)
def test_every_table_of_numbers_has_a_command(name):
    assert without_command((ROOT / name).read_text()) == []


@pytest.mark.parametrize("name", ["docs/results.md"])
def test_every_section_of_results_has_a_command(name):
    """A section that only refers to the numbers of others says so with a section of its own."""
    found = sections((ROOT / name).read_text())
    numbers = {title for title, part in found.items() if MEASURED.search(part)}
    bare = {title for title in numbers if not COMMAND.search(found[title])}
    assert bare == set()


def test_a_table_without_a_command_is_found():
    table = "| a | 98.9 % |\n"
    assert without_command(f"## One\n\n{table}") == ["One"]
    assert without_command(f"## One\n\n    teasim filter pool -o out\n\n{table}") == []
    assert without_command(f"## One\n\n    scripts/demo\n\n### Part\n\n{table}") == []
    assert without_command(f"## One\n\n### Part\n\n    teasim filter p\n\n## Two\n\n{table}") == [
        "Two"
    ]
    assert without_command("## One\n\n| `teasim filter` | flags |\n") == []
