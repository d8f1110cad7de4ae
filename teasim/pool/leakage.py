"""What gives incorrect demonstrations away without a look at what was done in them.

A filter that only measures length, or the size of a file, is no filter. Every number here is an
AUROC over the pairs of a correct and an incorrect demonstration: 0.5 says nothing, 1.0 says that
the incorrect ones always have more of it, 0.0 that they always have less. It reads the labels of
the pool and is for whoever makes pools, never for a filter.
"""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np

from teasim.common.errors import PoolError
from teasim.common.statistics import auroc
from teasim.pool.lerobot import Episode, Pool

MOTION_STEP = 5
"""Motion is measured between frames this far apart."""


def leakage(pool: Pool) -> dict[str, float]:
    """AUROC of every clue in `CLUES` alone, for incorrect against correct demonstrations.

    A pool without cameras has no clues in its pictures.

    Raises:
        PoolError: the pool does not say which demonstrations are correct, or all are the same.
    """
    records = [episode.record for episode in pool.episodes]
    if any(record is None for record in records):
        raise PoolError(f"The pool '{pool.root}' does not label its demonstrations as correct.")
    incorrect = [record is not None and not record.correct for record in records]
    if all(incorrect) or not any(incorrect):
        kind = "incorrect" if all(incorrect) else "correct"
        raise PoolError(
            f"All demonstrations of the pool '{pool.root}' are {kind}; leakage needs both kinds."
        )
    return {
        name: auroc([clue(pool, episode) for episode in pool.episodes], incorrect)
        for name, clue in CLUES.items()
        if pool.cameras or name not in OF_PICTURES
    }


def _length(_: Pool, episode: Episode) -> float:
    return float(episode.length)


def _segments(_: Pool, episode: Episode) -> float:
    return float(len(episode.spans()))


def _motion(pool: Pool, episode: Episode) -> float:
    """Mean difference of the first camera's grey values over MOTION_STEP frames."""
    clip = episode.clip(pool.cameras[0])
    frames = clip.frames(np.arange(0, episode.length, MOTION_STEP))
    grey = frames[:, ::2, ::2].mean(axis=3, dtype=np.float32)
    return float(np.abs(np.diff(grey, axis=0)).mean()) if len(grey) > 1 else 0.0


def _file_size(pool: Pool, episode: Episode) -> float:
    """Bytes of the files that hold the demonstration's videos."""
    paths = {episode.clip(camera).path for camera in pool.cameras}
    return float(sum(path.stat().st_size for path in paths))


CLUES: Mapping[str, Callable[[Pool, Episode], float]] = MappingProxyType(
    {
        "length": _length,
        "number of segments": _segments,
        "mean motion": _motion,
        "file size": _file_size,
    }
)
"""What might give a demonstration away, as a number."""
OF_PICTURES = ("mean motion", "file size")
"""The clues that need a camera."""
