"""What clips of every kind share: selections of frames in any order."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.source import Clip

MAX_SIDE = 8192
"""Largest width and height of a frame [pixels]; 8K video is 7680 x 4320."""

DIGEST_FRAMES = 8
"""Number of frames, spread evenly from the first to the last, that enter a digest."""


def gather(clip: Clip, indices: Sequence[int] | np.ndarray) -> np.ndarray:
    """Return the frames `indices` of a clip that can stream them in ascending order.

    Args:
        clip: Whose `stream` is used.
        indices: Frame numbers within the clip, in any order, repeated or not.

    Returns:
        uint8 RGB images of shape (len(indices), H, W, 3).

    Raises:
        IndexError: An index lies outside the clip, or there is none.
        PoolError: The file is missing or damaged, or it ends before a frame asked for.
    """
    wanted, places = np.unique(np.asarray(indices, dtype=np.int64), return_inverse=True)
    if not wanted.size:
        raise IndexError("No frame index was given.")
    return np.stack(list(clip.stream(wanted)))[places]


def ascending(clip: Clip, indices: Sequence[int] | np.ndarray) -> np.ndarray:
    """Return `indices` as an array of integers.

    Raises:
        IndexError: An index lies outside the clip, or they descend.
    """
    wanted = np.asarray(indices, dtype=np.int64)
    if wanted.size and (wanted.min() < 0 or wanted.max() >= clip.length):
        raise IndexError(
            f"Frames {wanted.min()} to {wanted.max()} were asked of a clip of {clip.length}."
        )
    if (np.diff(wanted) < 0).any():
        raise IndexError("The frames of a stream must be asked for in ascending order.")
    return wanted


def digest_sample(length: int) -> np.ndarray:
    """Return the ascending numbers of the frames that enter the digest of `length` frames."""
    return np.unique(np.linspace(0, length - 1, DIGEST_FRAMES).round().astype(np.int64))


def check_size(path: Path, width: int, height: int) -> None:
    """Refuse frames that are too large, before memory is allocated for them.

    Raises:
        PoolError: A side is longer than `MAX_SIDE`.
    """
    if max(width, height) > MAX_SIDE:
        raise PoolError(
            f"The frames in '{path}' are {width} x {height} pixels; at most "
            f"{MAX_SIDE} x {MAX_SIDE} are read."
        )


def file_version(path: Path, kind: str) -> tuple[int, int]:
    """Return time of change [ns] and size [bytes], which tell caches that a file has changed.

    Raises:
        PoolError: The file is missing; `kind` says what it is, e.g. 'video'.
    """
    try:
        status = path.stat()
    except OSError as error:
        raise PoolError(f"The {kind} '{path}' is missing.") from error
    return status.st_mtime_ns, status.st_size
