"""Settings read from the command line: how help texts come out, and what stays as tyro has it."""

import io
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from typing import Annotated

import pytest
import tyro

from teasim.common.cli import field_help, parse

EXAMPLES = ("teasim brew tea", "teasim brew tea --camera left")


@dataclass(frozen=True)
class Oven:
    """Settings of the oven."""

    heat: float = 0.5
    """Share of its power,
    0 to 1."""


@dataclass(frozen=True)
class Brew:
    """Brew a drink with a description that is a good deal longer than one line of 80 columns."""

    drink: tyro.conf.Positional[str]
    """The drink."""
    camera: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Cameras that look at it (or at the
    cup); all of them if none is
    named.

    It may be repeated."""
    oven: Oven = field(default_factory=Oven)
    """The oven."""


@dataclass(frozen=True)
class BrewAgain(Brew):
    """Brew another one."""

    times: int = 1
    """How often."""


Both = (
    Annotated[Brew, tyro.conf.subcommand("once")] | Annotated[BrewAgain, tyro.conf.subcommand("on")]
)


def help_of(settings, *before: str) -> list[str]:
    page = io.StringIO()
    with redirect_stdout(page), pytest.raises(SystemExit) as leave:
        parse(settings, [*before, "--help"], verb="brew", examples=EXAMPLES)
    assert leave.value.code == 0
    return page.getvalue().splitlines()


def test_line_breaks_become_blanks_and_paragraphs_stay():
    assert field_help(BrewAgain) == {
        "drink": "The drink.",
        "camera": "Cameras that look at it (or at the cup); all of them if none is named.\n\n"
        "It may be repeated.",
        "oven": "The oven.",
        "times": "How often.",
    }


@pytest.mark.parametrize(
    ("settings", "before"), [(Brew, ()), (Both, ()), (Both, ("once",)), (Both, ("on",))]
)
def test_help_is_wrapped_and_ends_with_the_examples(settings, before, monkeypatch):
    monkeypatch.delenv("COLUMNS", raising=False)
    lines = help_of(settings, *before)
    assert max(map(len, lines)) <= 80
    assert lines[-3:] == ["examples:", *(f"  {example}" for example in EXAMPLES)]


def test_a_sentence_is_broken_only_where_the_box_ends():
    boxed = [line.strip("│ ") for line in help_of(Brew)]
    start = next(k for k, line in enumerate(boxed) if "Cameras that look" in line)
    assert "Cameras that look at it (or at the cup); all of them" in boxed[start]


@pytest.mark.parametrize(
    ("settings", "argv", "expected"),
    [
        (Brew, ["tea"], Brew("tea")),
        (Brew, ["tea", "--camera", "a", "--camera", "b"], Brew("tea", ("a", "b"))),
        (Brew, ["tea", "--oven.heat", "0.7"], Brew("tea", oven=Oven(0.7))),
        (Both, ["on", "tea", "--times", "3"], BrewAgain("tea", times=3)),
    ],
)
def test_settings_are_read(settings, argv, expected):
    assert parse(settings, argv, verb="brew", examples=EXAMPLES) == expected


def test_a_default_instance_is_respected():
    given = Brew("milk", oven=Oven(0.1))
    assert parse(Brew, [], verb="brew", examples=EXAMPLES, default=given) == given


def test_a_usage_error_shows_no_examples(capsys):
    with pytest.raises(SystemExit) as leave:
        parse(Brew, ["tea", "--heat"], verb="brew", examples=EXAMPLES)
    assert leave.value.code == 2
    assert "examples:" not in capsys.readouterr().out
