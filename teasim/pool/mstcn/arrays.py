"""Arrays beside the labels of action segmentation data sets: features in the usual forms."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from teasim.common.errors import PoolError
from teasim.common.files import write_atomically

WINDOW = 16
"""Frames that features may lack at the end: those of an I3D window that is not full."""
SHARE = 20
"""In a long video, features may lack this fraction of it (one in 20): rounding of a sampling."""


class Layout(NamedTuple):
    """How the features of a video lie in their array."""

    frames_axis: int
    """Axis of time of the array once axes of length 1 are gone: 1 for D x T, 0 for T x D."""
    frames: int
    """Number of frames that have features and, where labels are known, a label."""
    certain: bool
    """False when both axes fit the number of labels; then D x T is assumed."""


def layout_of(shape: tuple[int, ...], labels: int | None) -> Layout | None:
    """Return how features of a `shape` (2 axes) lie, told by the number of labels.

    Args:
        shape: the two lengths.
        labels: number of labels of the video; None when none are known, and D x T is assumed.

    Returns:
        None when neither axis is about as long as there are labels.
    """
    if labels is None:
        return Layout(1, shape[1], True)
    few = min(max(WINDOW, labels // SHARE), labels // 4)
    for most in (0, few):
        fits = [axis for axis in (1, 0) if abs(shape[axis] - labels) <= most]
        if fits:
            return Layout(fits[0], min(shape[fits[0]], labels), len(fits) == 1)
    return None


def feature_shape(path: Path) -> tuple[int, int]:
    """Return the two lengths of an array of features; only its head is read.

    Raises:
        PoolError: the file is missing or damaged, or has no two axes longer than 1.
    """
    first, second = _open(path).shape
    return first, second


def read_array(path: Path) -> NDArray[np.floating]:
    """Return the numbers of a .npy file with two axes; nothing in it is ever executed.

    Raises:
        PoolError: the file is missing or damaged, or its numbers are not finite.
    """
    stored = np.array(_open(path))
    if not np.isfinite(stored).all():
        raise PoolError(f"The features '{path}' are not all finite numbers.")
    return stored


def write_array(path: Path, array: NDArray[np.float32]) -> None:
    """Write an array atomically.

    Raises:
        OSError: the file cannot be written.
    """

    def fill(target: Path) -> None:
        with target.open("wb") as file:  # given a path, numpy would add a suffix
            np.save(file, np.ascontiguousarray(array), allow_pickle=False)

    write_atomically(path, fill)


def _open(path: Path) -> NDArray[np.floating]:
    """Return the array with two axes, mapped: a claim larger than the file allocates nothing."""
    try:
        stored = np.load(path, allow_pickle=False, mmap_mode="r")
        if not isinstance(stored, np.ndarray) or not np.issubdtype(stored.dtype, np.floating):
            raise ValueError("no floating-point numbers")
    except Exception as error:  # a damaged head may raise whatever Python's parser raises
        raise PoolError(
            f"The features '{path}' are damaged: they are no array of floating-point numbers."
        ) from error
    shape = stored.shape
    if stored.ndim == 3 and 1 in shape:
        stored = stored.squeeze(axis=shape.index(1))
    if stored.ndim != 2 or not stored.size:
        raise PoolError(
            f"The features '{path}' have the shape {shape}; features by frames are needed."
        )
    return stored
