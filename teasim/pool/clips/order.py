"""What clips of every kind share: selections of frames in any order."""

from collections.abc import Sequence

import numpy as np

from teasim.pool.source import Clip

MAX_SIDE = 8192
"""Largest width and height of a frame [pixels]; 8K video is 7680 x 4320."""


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


def sample(length: int, count: int) -> np.ndarray:
    """Return at most `count` frame numbers spread evenly from the first frame to the last."""
    return np.unique(np.linspace(0, length - 1, count).round().astype(np.int64))
