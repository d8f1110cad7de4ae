"""Drawn and described pools, kept in files so that a draw can be resumed."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.judging.decision.description import describe
from filtering.judging.decision.observed import canonical
from filtering.judging.decision.prior.pools import draw_pool
from teasim.common.files import write_atomically

CHUNK = 250
"""Number of pools per file."""


@dataclass(frozen=True)
class Lesson:
    """A described pool and the truth about it."""

    rows: NDArray[np.float32]
    """(D, F) columns."""
    pairs: NDArray[np.float32]
    """(D, D, P) columns of pairs."""
    incorrect: NDArray[np.bool_]
    """(D,) truth."""
    facts: NDArray[np.bool_]
    """(4,) truth about the pool."""


def draw_lesson(seed: int, number: int) -> Lesson:
    """Draw and describe pool `number` of a seed."""
    drawn = draw_pool(np.random.default_rng([seed, number]))
    pool = canonical(drawn.observed)
    found = describe(pool.pool)
    return Lesson(found.rows, found.pairs, drawn.incorrect[pool.rows], drawn.facts)


def draw_lessons(folder: Path, seed: int, count: int) -> Iterator[int]:
    """Draw `count` pools into files of `folder`; existing files are kept. Yield pools so far."""
    with threadpool_limits(limits=1, user_api="blas"):
        for first in range(0, count, CHUNK):
            path = folder / f"seed{seed}_{first:06d}.npz"
            if not path.exists():
                _write(path, [draw_lesson(seed, first + k) for k in range(CHUNK)])
            yield first + CHUNK


def read_lessons(folder: Path, seed: int, count: int) -> list[Lesson]:
    """Read the first `count` pools of a seed."""
    lessons: list[Lesson] = []
    for first in range(0, count, CHUNK):
        with np.load(folder / f"seed{seed}_{first:06d}.npz", allow_pickle=False) as stored:
            lessons += _split({name: stored[name] for name in stored.files})
    return lessons[:count]


def _write(path: Path, lessons: list[Lesson]) -> None:
    arrays: dict[str, Any] = {
        "sizes": np.array([len(lesson.rows) for lesson in lessons]),
        "rows": np.concatenate([lesson.rows for lesson in lessons]),
        "pairs": np.concatenate([lesson.pairs.reshape(-1, _width(lesson)) for lesson in lessons]),
        "incorrect": np.concatenate([lesson.incorrect for lesson in lessons]),
        "facts": np.stack([lesson.facts for lesson in lessons]),
    }

    def fill(target: Path) -> None:
        with target.open("wb") as stream:
            np.savez(stream, **arrays)

    write_atomically(path, fill)


def _width(lesson: Lesson) -> int:
    return lesson.pairs.shape[2]


def _split(stored: dict[str, NDArray[np.generic]]) -> list[Lesson]:
    sizes = stored["sizes"].astype(np.int64)
    rows = np.split(stored["rows"], np.cumsum(sizes)[:-1])
    truths = np.split(stored["incorrect"], np.cumsum(sizes)[:-1])
    pairs = np.split(stored["pairs"], np.cumsum(sizes**2)[:-1])
    return [
        Lesson(
            np.asarray(row, np.float32),
            np.asarray(pair, np.float32).reshape(size, size, -1),
            np.asarray(truth, np.bool_),
            np.asarray(facts, np.bool_),
        )
        for size, row, pair, truth, facts in zip(
            sizes, rows, pairs, truths, stored["facts"], strict=True
        )
    ]
