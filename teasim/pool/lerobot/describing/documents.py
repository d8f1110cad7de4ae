"""JSON in, dictionaries out, with bounds on what is read; damage becomes one sentence."""

import json
from pathlib import Path
from typing import Any

from teasim.common.errors import PoolError

MOST_BYTES = 256 * 1024**2
"""Largest metadata file that is read; the lines of a million demonstrations need less."""


def read_json(path: Path) -> dict[str, Any]:
    """Return the object a JSON file holds.

    Raises:
        PoolError: The file is missing, too large, or no JSON object.
    """
    return _parsed(path, _text(path))


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Return the objects of a file of JSON lines; empty lines are left out.

    Raises:
        PoolError: The file is missing, too large, or a line is no JSON object.
    """
    return [
        _parsed(path, line, f"line {number}")
        for number, line in enumerate(_text(path).split("\n"), start=1)
        if line.strip()
    ]


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > MOST_BYTES:
            raise PoolError(f"The file '{path}' is larger than {MOST_BYTES} bytes.")
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as error:
        raise PoolError(f"The file '{path}' is missing.") from error
    except (OSError, ValueError) as error:
        raise PoolError(f"The file '{path}' is damaged: it is no readable JSON.") from error


def _parsed(path: Path, text: str, part: str = "it") -> dict[str, Any]:
    try:
        value = json.loads(text)
    except (ValueError, RecursionError) as error:  # nested too deep, or a number too long
        raise PoolError(f"The file '{path}' is damaged: {part} is no readable JSON.") from error
    if not isinstance(value, dict):
        raise PoolError(f"The file '{path}' is damaged: {part} is not a JSON object.")
    return value
