"""A vector per moment, made comparable between videos.

Two things are seen in a moment: how it looks (pooled maps of the backbone) and what lies where
(cells of the picture). Each is scaled within its video, which takes out its light and camera, and
reduced to the main directions of the pool; `weighing` says how much looks count beside places.
`agreeing` then weighs directions by how well the videos agree in them where they show the same:
what is placed at random, who demonstrates and what else moves in the picture differs between
counterparts and counts little. This is relevant component analysis (Bar-Hillel et al., 2005) with
counterparts in place of labelled chunklets.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float32]
"""(n, K), one row per moment."""
Array = NDArray[np.float64]

DIRECTIONS = 48
"""Main directions of the pool that are kept of looks, and as many of places."""
KEPT = 32
"""Directions kept once they are weighed by agreement."""
COARSE = 3
"""Cells per side that are averaged for places: a moving hand must overlap with its counterpart."""
SAMPLED = 4000
"""About how many moments of a pool its main directions are found from."""
RIDGE = 0.05
"""Least variance of a direction between counterparts [mean variance]."""


BRIGHTNESS = 110.0
"""Median brightness that the cells of every video are scaled to where they are compared, 0..255."""


@dataclass(frozen=True)
class Video:
    """What one camera saw of one demonstration, moment by moment."""

    looks: NDArray[np.float32]
    """(n, F) features, see `filtering.vision.frame_features`."""
    cells: NDArray[np.uint8]
    """(n, H, W, 3) RGB, see `filtering.moments.cells`."""

    def __len__(self) -> int:
        """Number of moments."""
        return len(self.looks)

    def lit_alike(self) -> NDArray[np.float32]:
        """Return (n, H, W, 3): the cells scaled to BRIGHTNESS, so that lamps do not count."""
        cells = self.cells.astype(np.float32)
        cells *= BRIGHTNESS / max(float(np.median(cells)), 1.0)
        return cells


@dataclass(frozen=True)
class Blocks:
    """The two parts of the vectors of a pool, of equal total variance."""

    looks: tuple[Array, ...]
    """Per video (n, DIRECTIONS) or less, how its moments look."""
    places: tuple[Array, ...]
    """Per video (n, DIRECTIONS) or less, what lies where."""

    def vectors(self, weight: float = 1.0) -> list[Vectors]:
        """Return per video (n, K): looks, times `weight`, and places side by side."""
        pairs = zip(self.looks, self.places, strict=True)
        return [np.hstack((weight * look, place)).astype(np.float32) for look, place in pairs]


def moment_blocks(videos: Sequence[Video]) -> Blocks:
    """Return looks and places of the moments of a pool's videos."""
    looks = _main_directions([_scaled(video.looks) for video in videos])
    places = _main_directions([_places(video.cells) for video in videos])
    return Blocks(tuple(looks), tuple(places))


def agreeing(vectors: Sequence[Vectors], differences: Iterable[Vectors]) -> list[Vectors]:
    """Return per video (n, KEPT): directions weighed by how well counterparts agree in them.

    Args:
        vectors: per video (n, K).
        differences: (P, K) each, what counterparts differ by.
    """
    width = vectors[0].shape[1]
    scatter, count = np.zeros((width, width)), 0
    for rows in differences:
        wide = rows.astype(np.float64)
        scatter += wide.T @ wide
        count += len(rows)
    if not scatter.any():  # there are no counterparts, or all of them are copies
        return list(vectors)
    variances, axes = np.linalg.eigh(scatter / count)
    variances = np.maximum(variances, 0.0)
    transform = axes / np.sqrt(variances + RIDGE * variances.mean())
    return _reduced([rows @ transform for rows in vectors], KEPT)


def _scaled(looks: NDArray[np.float32]) -> Array:
    """Scale each feature (n, F) within its video."""
    wide = looks.astype(np.float64)
    return np.asarray((wide - wide.mean(axis=0)) / (wide.std(axis=0) + 1e-6))


def _places(cells: NDArray[np.uint8]) -> Array:
    """Return (n, F): coarse cells without what stays the same, the video's variance 1."""
    n, height, width, _ = cells.shape
    rows, columns = max(1, height // COARSE), max(1, width // COARSE)
    cut = cells[:, : rows * (height // rows), : columns * (width // columns)]
    grid = cut.reshape(n, rows, height // rows, columns, width // columns, 3)
    flat = grid.mean(axis=(2, 4), dtype=np.float64).reshape(n, -1)
    flat -= flat.mean(axis=0)
    return np.asarray(flat / (np.sqrt(flat.var(axis=0).sum()) + 1e-6))


def _main_directions(blocks: Sequence[Array]) -> list[Array]:
    reduced = _reduced(blocks, DIRECTIONS)
    scale = np.sqrt(np.mean([np.square(rows).sum(axis=1).mean() for rows in reduced]))
    return [rows / (scale + 1e-12) for rows in reduced]


def _reduced(blocks: Sequence[NDArray[np.floating]], kept: int) -> list[NDArray]:
    """Return the blocks (n, F) in their `kept` main directions; strides keep the cost bounded."""
    stride = max(1, sum(map(len, blocks)) // SAMPLED)
    sample = np.concatenate([rows[stride // 2 :: stride] for rows in blocks])
    mean = sample.mean(axis=0)
    axes = np.linalg.svd(sample - mean, full_matrices=False)[2][:kept]
    return [np.asarray((rows - mean) @ axes.T) for rows in blocks]
