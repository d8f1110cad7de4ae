"""Names that a person gives to sub-tasks that were found: a file of lines 'step 1 = pour water'."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from teasim.common.errors import ConfigError, PoolError
from teasim.pool.types import Span

FORM = "lines 'step 1 = pour water', or a JSON object of them"


def read_names(path: Path | str) -> dict[str, str]:
    """Return the new name of each sub-task by the old one.

    Raises:
        ConfigError: the file is missing or not of this form.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ConfigError(f"The file of names '{path}' cannot be read; it needs {FORM}.") from error
    names = _from_json(path, text) if text.lstrip().startswith("{") else _from_lines(path, text)
    if not names:
        raise ConfigError(f"The file of names '{path}' is empty; it needs {FORM}.")
    return names


def check_names(names: Mapping[str, str], known: Sequence[str]) -> None:
    """Refuse a name for a sub-task that was not found.

    Raises:
        ConfigError: there is no such sub-task.
    """
    for name in names:
        if name not in known:
            raise ConfigError(f"'{name}' is no sub-task that was found; choose {', '.join(known)}.")


def renamed(spans: Sequence[Span], names: Mapping[str, str]) -> tuple[Span, ...]:
    """Return spans under their new names; neighbours that come to the same name are joined."""
    joined: list[Span] = []
    for span in spans:
        name = names.get(span.subtask, span.subtask)
        last = joined[-1] if joined else None
        if last and last.subtask == name and last.stop == span.start:
            joined[-1] = Span(name, last.start, span.stop)
        else:
            joined.append(Span(name, span.start, span.stop))
    return tuple(joined)


def _from_json(path: Path, text: str) -> dict[str, str]:
    try:
        names = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ConfigError(f"The file of names '{path}' is no readable JSON.") from error
    if not all(isinstance(name, str) and name.strip() for name in names.values()):
        raise ConfigError(f"The file of names '{path}' is not of the form {FORM}.")
    return {old: new.strip() for old, new in names.items()}


def _from_lines(path: Path, text: str) -> dict[str, str]:
    names: dict[str, str] = {}
    for place, line in enumerate(text.splitlines(), start=1):
        old, equals, new = (part.strip() for part in line.partition("="))
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if not (old and equals and new) or old in names:
            raise ConfigError(
                f"Line {place} of '{path}' is '{line.strip()}'; write 'step 1 = pour water', each "
                "sub-task once."
            )
        names[old] = new
    return names


def listed(spans: Sequence[Sequence[Span]]) -> tuple[str, ...]:
    """Return the names in spans in natural order of first mention, without repetition.

    Raises:
        PoolError: there are none.
    """
    names = tuple(dict.fromkeys(span.subtask for own in spans for span in own))
    if not names:
        raise PoolError("The table of segments names no sub-task.")
    return names
