"""What all verbs share: settings read from the command line, and examples below their help."""

import sys
from collections.abc import Sequence
from typing import Any, TypeVar

import tyro

Settings = TypeVar("Settings")


def parse(
    settings: type[Settings],
    argv: Sequence[str] | None,
    *,
    verb: str,
    examples: Sequence[str],
    **options: Any,
) -> Settings:
    """Read the settings of a verb from its arguments; `--help` ends with the examples.

    Args:
        settings: frozen dataclass, or union of annotated ones for a verb with subcommands; the
            lines below its fields are the help texts.
        argv: arguments after the verb; None means those of the process.
        verb: name of the verb.
        examples: two or more command lines, each starting with `teasim`.
        options: further arguments of `tyro.cli`, e.g. `description`.

    Raises:
        SystemExit: after `--help` (code 0), or a usage error (code 2).
    """
    try:
        return tyro.cli(settings, args=argv, prog=f"teasim {verb}", **options)
    except SystemExit as leave:
        if leave.code in (0, None):
            lines = ["examples:", *(f"  {example}" for example in examples)]
            print("\n".join(lines), file=sys.stdout)
        raise
