"""A precedence graph: known rules of order, given beside the pool.

A rare legal order and a wrong order look alike in a pool. With a precedence graph only violated
pairs of the graph count as disorder, and next steps do not count.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from teasim.common.arrays import Array
from teasim.common.errors import ConfigError

Pairs = tuple[tuple[str, str], ...]
"""Names of sub-tasks (a, b): a has to come before b."""


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


def precedence_graph(pairs: Pairs, subtasks: Sequence[str]) -> Array:
    """Return (T, T): 1 where a has to come before b, directly or through other sub-tasks.

    Raises:
        ConfigError: a pair names an unknown sub-task, or the pairs form a cycle.
    """
    numbers = {name: number for number, name in enumerate(subtasks)}
    graph = np.zeros((len(subtasks), len(subtasks)), dtype=bool)
    for pair in pairs:
        for name in pair:
            if name not in numbers:
                raise ConfigError(
                    f"The precedence names the unknown sub-task '{name}'; the pool has "
                    f"{', '.join(subtasks)}."
                )
        graph[numbers[pair[0]], numbers[pair[1]]] = True
    for via in range(len(subtasks)):
        graph |= graph[:, via, None] & graph[None, via, :]
    cycle = np.flatnonzero(graph.diagonal())
    if len(cycle):
        raise ConfigError(
            f"The precedence has a cycle: '{subtasks[cycle[0]]}' would have to come before itself."
        )
    return graph.astype(np.float64)


def _from_lines(path: Path | str, text: str) -> Pairs:
    pairs = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split("#")[0].strip()
        if not words:
            continue
        first, between, second = words.partition(" before ")
        if not between or not first.strip() or not second.strip():
            raise ConfigError(f"Line {number} of '{path}' is '{line}'; write 'a before b'.")
        pairs.append((first.strip(), second.strip()))
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
