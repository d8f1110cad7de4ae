"""The text files of action segmentation data sets: the mapping, and labels in the forms in use.

Labels come one per frame and line, or all on one line below "### Frame level recognition: ###", as
MS-TCN and NeuralNetwork-Viterbi write what they predict.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teasim.common.errors import PoolError
from teasim.pool.types import NO_SUBTASK

BACKGROUND = "background"
"""Label of frames that belong to no segment; the published measures leave it out."""
BACKGROUNDS = (BACKGROUND, "SIL", "action_start", "action_end")
"""Labels of no sub-task: GTEA's and 50-Salads' background, Breakfast's silence, 50-Salads' ends."""
COMMENT = "#"
FRAME_LEVEL = "### frame level recognition"
LABEL_SUFFIXES = (".txt", ".recog")
VIDEO_SUFFIXES = (".avi", ".mkv", ".mov", ".mp4", ".mpg", ".webm")


def read_mapping(path: Path, background: Sequence[str]) -> tuple[str, ...]:
    """Return the names in the order of their numbers, without those in `background`.

    Raises:
        PoolError: the mapping is missing or damaged.
    """
    if not path.is_file():
        raise PoolError(
            f"The folder '{path.parent}' has no {path.name}, which an MS-TCN folder needs "
            "(lines 'number name')."
        )
    named: dict[int, str] = {}
    for place, line in enumerate(read_lines(path), start=1):
        if not line or line.startswith(COMMENT):
            continue
        number, _, name = line.partition(" ")
        if not _is_number(number) or not name or int(number) in named or name in named.values():
            raise PoolError(
                f"Line {place} of '{path}' is '{line}'; a number and a name are needed, each new."
            )
        named[int(number)] = name
    if not named:
        raise PoolError(f"'{path}' is empty; it needs lines 'number name'.")
    return tuple(named[number] for number in sorted(named) if named[number] not in background)


def read_labels(
    path: Path, names: Sequence[str], background: Sequence[str] = (BACKGROUND,)
) -> NDArray[np.int64]:
    """Return the number in `names` of the label of each frame, (n,), NO_SUBTASK for background.

    Raises:
        PoolError: the file is missing, empty or no text, or has a label that is in neither list.
    """
    numbers = {name: number for number, name in enumerate(names)}
    numbers |= dict.fromkeys(background, NO_SUBTASK)
    lines = read_lines(path)
    labels = []
    for place, label in _labels(lines, numbers):
        if label not in numbers:
            raise PoolError(
                f"Line {place} of '{path}' has the label '{label}', which mapping.txt lacks; "
                f"it has {', '.join(names)}."
            )
        labels.append(numbers[label])
    if not labels:
        raise PoolError(f"'{path}' is empty; it needs one label per frame and line.")
    return np.array(labels, dtype=np.int64)


def read_lines(path: Path) -> list[str]:
    """Return the lines of a text file, each blank in them one space, without empty ones at its end.

    Raises:
        PoolError: the file cannot be read or is no text.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").rstrip().splitlines()
    except OSError as error:
        raise PoolError(f"'{path}' cannot be read: {error.strerror}.") from error
    except UnicodeDecodeError as error:
        raise PoolError(f"'{path}' is damaged: it is no text.") from error
    return [" ".join(line.split()) for line in lines]


def video_name(file_name: str) -> str:
    """Return the video that a file is about: 'a' for a.txt, a.npy, a.recog, a.mp4.txt and a."""
    for suffixes in ((*LABEL_SUFFIXES, ".npy"), VIDEO_SUFFIXES):
        for suffix in suffixes:
            file_name = file_name.removesuffix(suffix)
    return file_name


def _is_number(text: str) -> bool:
    return text.isascii() and text.isdecimal() and len(text) <= 9


def _labels(lines: Sequence[str], known: Mapping[str, int]) -> Iterator[tuple[int, str]]:
    """Yield each frame's label and the number of its line, from 1."""
    heads = [n for n, line in enumerate(lines) if line.casefold().startswith(FRAME_LEVEL)]
    one_line = len(lines) == 1 and lines[0] not in known
    for place, line in enumerate(lines[heads[0] + 1 :] if heads else lines, start=1):
        if line.startswith(COMMENT) and line not in known:
            continue
        if heads or one_line:
            after = place + (heads[0] + 1 if heads else 0)
            yield from ((after, label) for label in _split(line, known))
        else:
            yield place, line


def _split(line: str, known: Mapping[str, int]) -> Iterator[str]:
    """Yield the labels on one line; of labels with blanks the longest that fits."""
    words = line.split()
    longest = max((len(name.split()) for name in known), default=1)
    first = 0
    while first < len(words):
        ends = range(min(first + longest, len(words)), first, -1)
        fits = (end for end in ends if " ".join(words[first:end]) in known)
        end = next(fits, first + 1)
        yield " ".join(words[first:end])
        first = end
