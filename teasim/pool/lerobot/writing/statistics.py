"""The statistics LeRobot normalises with: exact for logs, from a fixed subsample for images."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}

FRAME_STRIDE = 5
"""Every fifth frame enters the image statistics, the first one always."""
PIXEL_STRIDE = 2
"""Every second row and column enters the image statistics."""

N_LEVELS = 256
"""Levels of a uint8 colour channel."""

Stats = dict[str, list[Any]]


def column_stats(values: np.ndarray) -> Stats:
    """Statistics of a log of n frames.

    Args:
        values: (n,) or (n, D) numbers or booleans.

    Returns:
        min, max, mean, std and quantiles as lists of length D (1 for scalars); count as [n].
    """
    table = np.asarray(values, dtype=np.float64).reshape(len(values), -1)
    stats: Stats = {
        "min": table.min(0).tolist(),
        "max": table.max(0).tolist(),
        "mean": table.mean(0).tolist(),
        "std": table.std(0).tolist(),
        "count": [len(table)],
    }
    for name, level in QUANTILES.items():
        stats[name] = np.quantile(table, level, axis=0).tolist()
    return stats


class ImageHistogram:
    """Counts of the 256 levels per colour channel: everything image statistics need, poolable."""

    def __init__(self, counts: np.ndarray | None = None, n_frames: int = 0) -> None:
        """Start empty, or from `counts` (3, 256) of `n_frames` frames."""
        self.counts = np.zeros((3, N_LEVELS), dtype=np.int64) if counts is None else counts
        self.n_frames = n_frames

    def add(self, image: np.ndarray) -> None:
        """Count the subsampled pixels of an (H, W, 3) uint8 image."""
        pixels = image[::PIXEL_STRIDE, ::PIXEL_STRIDE]
        for channel in range(3):
            self.counts[channel] += np.bincount(pixels[..., channel].ravel(), minlength=N_LEVELS)
        self.n_frames += 1

    def stats(self) -> Stats:
        """Statistics of shape (3, 1, 1) in [0, 1]; count is the number of frames looked at."""
        levels = np.arange(N_LEVELS) / (N_LEVELS - 1)
        total = self.counts.sum(1)
        mean = self.counts @ levels / total
        variance = self.counts @ levels**2 / total - mean**2
        seen = self.counts > 0
        lowest = levels[seen.argmax(1)]
        highest = levels[N_LEVELS - 1 - seen[:, ::-1].argmax(1)]
        stats: Stats = {
            "min": _per_channel(lowest),
            "max": _per_channel(highest),
            "mean": _per_channel(mean),
            "std": _per_channel(np.sqrt(np.maximum(variance, 0.0))),
            "count": [self.n_frames],
        }
        cumulated = self.counts.cumsum(1) / total[:, None]
        for name, level in QUANTILES.items():
            stats[name] = _per_channel(levels[(cumulated >= level).argmax(1)])
        return stats


def pool_histograms(histograms: Sequence[ImageHistogram]) -> ImageHistogram:
    """The histogram of all frames that entered any of `histograms`."""
    counts = np.sum([histogram.counts for histogram in histograms], axis=0)
    return ImageHistogram(counts, sum(histogram.n_frames for histogram in histograms))


def flatten(stats: Mapping[str, Stats]) -> dict[str, list[Any]]:
    """Statistics per feature as columns of the episodes table: stats/FEATURE/NAME."""
    return {
        f"stats/{feature}/{name}": values
        for feature, block in stats.items()
        for name, values in block.items()
    }


def _per_channel(values: np.ndarray) -> list[list[list[float]]]:
    reshaped: list[list[list[float]]] = values.reshape(3, 1, 1).tolist()
    return reshaped
