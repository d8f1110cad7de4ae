"""Activations over time to intervals: when each channel is active (paper section 3.2)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_closing, binary_opening

Activations = NDArray[np.floating]
"""How strongly each channel is seen in the frames of one segment.  # (n, N), n <= 64, N = 32"""


@dataclass(frozen=True)
class Intervals:
    """The intervals of one segment, by channel and then by time."""

    channels: NDArray[np.int64]
    """Channel of each interval, 0..N-1.  # (I,)"""
    starts: NDArray[np.int64]
    """First frame.  # (I,)"""
    stops: NDArray[np.int64]
    """Frame after the last.  # (I,)"""
    values: NDArray[np.float64]
    """Largest activation of the channel within the interval.  # (I,)"""

    def __post_init__(self) -> None:
        """Check that the fields belong together and make the arrays read-only."""
        arrays = (self.channels, self.starts, self.stops, self.values)
        if len({len(array) for array in arrays}) != 1:
            raise ValueError(f"fields differ in length: {[len(array) for array in arrays]}")
        if (self.starts >= self.stops).any():
            raise ValueError("an interval is empty")
        for array in arrays:
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.channels)

    def without(self, channels: Iterable[int]) -> "Intervals":
        """Return the intervals of all other channels."""
        kept = ~np.isin(self.channels, list(channels))
        return Intervals(
            self.channels[kept], self.starts[kept], self.stops[kept], self.values[kept]
        )


def mean_thresholds(activations: Sequence[Activations]) -> NDArray[np.float64]:
    """Return each channel's mean (N,) over all frames of the training segments."""
    means: NDArray[np.float64] = np.concatenate(activations).mean(axis=0, dtype=np.float64)
    return means


def find_intervals(
    activations: Activations, thresholds: NDArray[np.float64], structure: int
) -> Intervals:
    """Return when the activations (n, N) of a segment are above their thresholds (N,).

    Args:
        activations: of one segment.
        thresholds: one for each channel.
        structure: length of the structuring element; gaps shorter than this are closed, then
            intervals shorter than this are dropped [frames].
    """
    active = _smooth(activations > thresholds, structure)
    edges = np.diff(active.T.astype(np.int8), axis=1, prepend=0, append=0)
    channels, starts = np.nonzero(edges == 1)
    _, stops = np.nonzero(edges == -1)
    values = [
        activations[start:stop, channel].max()
        for channel, start, stop in zip(channels, starts, stops, strict=True)
    ]
    return Intervals(channels, starts, stops, np.array(values, dtype=np.float64))


def _smooth(active: NDArray[np.bool_], structure: int) -> NDArray[np.bool_]:
    """Close, then open along time; (n, N)."""
    element = np.ones((structure, 1), dtype=bool)
    # Padded on both sides: SciPy would count what the closing adds beyond the ends as inactive, and
    # so wear away what is active at the first or the last frame.
    padded = np.pad(active, ((structure, structure), (0, 0)))
    smooth: NDArray[np.bool_] = binary_opening(binary_closing(padded, element), element)
    return smooth[structure:-structure]
