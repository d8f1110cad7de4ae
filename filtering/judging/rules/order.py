"""Rules of order as a user gives them: 'a before b', in words or in a file.

A rare legal order and a wrong order look alike in a pool; only somebody who knows the task can tell
them apart.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teasim.common.errors import ConfigError

Pairs = tuple[tuple[str, str], ...]
"""Names of sub-tasks (a, b): a before b."""
BETWEEN = " before "
"""What stands between the two names of a pair."""


def pairs_of(words: Sequence[str]) -> Pairs:
    """Return the pairs of each word: 'a before b', or a file of such lines.

    Raises:
        ConfigError: a word is neither, or a file cannot be read, is empty, or contains something
            else.
    """
    return tuple(pair for word in words for pair in _pairs_of_word(word))


def _pairs_of_word(word: str) -> Pairs:
    if BETWEEN in word and not Path(word).exists():
        return (_pair(word, f"'{word}'"),)
    if not Path(word).exists():
        raise ConfigError(
            f"'{word}' is neither a file nor a pair of sub-tasks; write 'a before b'."
        )
    return read_precedence(word)


def read_precedence(path: Path | str) -> Pairs:
    """Read a file of lines "a before b" (# begins a comment), or a JSON list of pairs [a, b].

    Raises:
        ConfigError: the file cannot be read, is empty, or contains something else.
    """
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"'{path}' cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"'{path}' is not a text file.") from error
    pairs = _from_json(path, text) if text.lstrip().startswith("[") else _from_lines(path, text)
    if not pairs:
        raise ConfigError(f"'{path}' is empty; it needs lines 'a before b'.")
    return pairs


def check_pairs(pairs: Pairs, what: str) -> None:
    """Refuse what is no pair of names.

    Raises:
        ConfigError: an entry is something else, such as one name.
    """
    for pair in pairs:
        if isinstance(pair, str) or len(pair) != 2:
            raise ConfigError(f"{what} has the entry {pair!r}; give pairs of names (a, b).")


def number_of(name: str, subtasks: Sequence[str], what: str) -> int:
    """Return the number of a sub-task; case, and _ for a space, do not matter.

    Args:
        name: as the user wrote it.
        subtasks: names of the pool.
        what: the setting that names it, for the message.

    Raises:
        ConfigError: the pool has no such sub-task.
    """
    known = {_plain(subtask): number for number, subtask in enumerate(subtasks)}
    if _plain(name) not in known:
        raise ConfigError(
            f"The setting {what} names the unknown sub-task '{name}'; the pool has "
            f"{', '.join(subtasks)}."
        )
    return known[_plain(name)]


def numbered(pairs: Pairs, subtasks: Sequence[str], what: str) -> list[tuple[int, int]]:
    """Return pairs as numbers of sub-tasks.

    Raises:
        ConfigError: a pair names an unknown sub-task, or one sub-task twice.
    """
    found = [(number_of(a, subtasks, what), number_of(b, subtasks, what)) for a, b in pairs]
    for (first, second), (name, _) in zip(found, pairs, strict=True):
        if first == second:
            raise ConfigError(
                f"The setting {what} puts '{name}' before itself; name two sub-tasks."
            )
    return found


def precedence_graph(pairs: Pairs, subtasks: Sequence[str]) -> NDArray[np.bool_]:
    """Return (T, T): True where a has to come before b, directly or through other sub-tasks.

    Raises:
        ConfigError: a pair names an unknown sub-task, or the pairs form a cycle.
    """
    graph = np.zeros((len(subtasks), len(subtasks)), dtype=np.bool_)
    for first, second in numbered(pairs, subtasks, "precedence"):
        graph[first, second] = True
    for via in range(len(subtasks)):
        graph |= graph[:, via, None] & graph[None, via, :]
    cycle = np.flatnonzero(graph.diagonal())
    if len(cycle):
        raise ConfigError(
            f"The precedence has a cycle: '{subtasks[cycle[0]]}' would have to come before itself."
        )
    return graph


def _plain(name: str) -> str:
    return name.strip().lower().replace("_", " ")


def _pair(text: str, where: str) -> tuple[str, str]:
    first, between, second = (part.strip() for part in text.partition(BETWEEN))
    if not between or not first or not second:
        raise ConfigError(f"{where} is '{text}'; write 'a before b'.")
    return first, second


def _from_lines(path: Path | str, text: str) -> Pairs:
    pairs = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#")[0].strip()
        if words:
            pairs.append(_pair(words, f"Line {number} of '{path}'"))
    return tuple(pairs)


def _from_json(path: Path | str, text: str) -> Pairs:
    try:
        entries = json.loads(text)
    except ValueError as error:
        raise ConfigError(f"'{path}' is not valid JSON: {error}.") from error
    for entry in entries:
        strings = isinstance(entry, list) and all(isinstance(name, str) for name in entry)
        if not strings or len(entry) != 2:
            raise ConfigError(f'\'{path}\' has the entry {json.dumps(entry)}; write ["a", "b"].')
    return tuple((first, second) for first, second in entries)
