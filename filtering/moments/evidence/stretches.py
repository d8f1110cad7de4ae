"""Evidence of one kind, where it is seen, and how a curve over moments is summed up."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WORST = 12
"""The worst 1 / WORST of a video counts."""
BRIEF = 5
"""Number of the strangest moments that count, one second at `score.RATE`: much of a step looks like
other steps, however long the video is. Chosen with SCALE and SCATTER of these kinds, see
`moments.decision`; 3 and 8 are about as good, shares of the video are worse."""


@dataclass(frozen=True)
class Stretch:
    """Where evidence comes from: moments of a video that shows what it is about."""

    video: int
    """Number of the video."""
    start: int
    """First moment."""
    stop: int
    """Moment after the last one."""


@dataclass(frozen=True)
class Evidence:
    """One kind of evidence against each of D demonstrations."""

    values: Array
    """(D,) how much, higher is worse."""
    own: tuple[Stretch, ...]
    """Per demonstration where in itself it shows."""
    other: tuple[Stretch, ...]
    """Per demonstration where in another video that which it is about is seen."""


def worst(curve: NDArray[np.floating]) -> float:
    """Return the mean of the largest twelfth of a curve (n,), of 3 values or more."""
    return mean_of_largest(curve, max(3, len(curve) // WORST))


def brief(curve: NDArray[np.floating]) -> float:
    """Return the mean of the BRIEF largest values of a curve (n,), of all where it has fewer."""
    return mean_of_largest(curve, BRIEF)


def peak(curve: NDArray[np.floating]) -> tuple[int, int]:
    """Return the stretch (start, stop) about the largest value in which a curve is half as high.

    The curve is averaged over a twelfth of its length first.
    """
    width = max(3, len(curve) // WORST)
    smooth = np.convolve(np.pad(curve, width // 2, mode="edge"), np.ones(width) / width, "valid")
    smooth = smooth[: len(curve)]
    top = int(smooth.argmax())
    low = np.flatnonzero(smooth < (smooth[top] + np.median(smooth)) / 2)
    start = int(low[low < top].max(initial=-1)) + 1
    stop = int(low[low > top].min(initial=len(curve)))
    return start, stop


def mean_of_largest(curve: NDArray[np.floating], count: int) -> float:
    """Return the mean of the `count` largest values of a curve (n,), of all where it has fewer."""
    return float(np.sort(curve)[-count:].mean())


def less(value: float, share: float) -> float:
    """Return evidence about a stretch of which a share is replaced."""
    return value * (1 - share) if value > 0 else value
