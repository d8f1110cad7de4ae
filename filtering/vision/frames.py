"""Frames of a segment: which ones, and at what size (paper section 3.2)."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from teasim.common.errors import ConfigError
from teasim.pool import Span
from teasim.pool.source import Clip, Source

LARGEST_SIDE = 224
"""Frames whose shorter side is longer are area-averaged down to it [pixels]; the backbone was
trained at this size. Smaller frames stay as they are: enlarging costs time and adds nothing."""

MAIN_CAMERA = "left"
"""The camera that sees both arms and every object."""

Frames = NDArray[np.uint8]
"""(n, H, W, 3) RGB."""


def uniform_indices(start: int, stop: int, count: int) -> NDArray[np.int64]:
    """Return at most `count` different frames, evenly spread over start <= frame < stop.

    A span shorter than `count` gives every one of its frames once.
    """
    length = stop - start
    if length <= count:
        return np.arange(start, stop)
    # The middles of `count` equal parts: both ends are treated alike.
    return (start + (np.arange(count) + 0.5) * length / count).astype(np.int64)


def segment_indices(
    spans: tuple[Span, ...], count: int, *, exact: bool = False
) -> list[NDArray[np.int64]]:
    """Return the frames to look at in each segment: at most `count`, or exactly so many.

    Exactly so many means that frames of a shorter segment are repeated evenly.
    """
    if exact:
        parts = (np.arange(count) + 0.5) / count
        return [(span.start + parts * (span.stop - span.start)).astype(np.int64) for span in spans]
    return [uniform_indices(span.start, span.stop, count) for span in spans]


def fit_size(frames: Frames) -> Frames:
    """Shrink frames (n, H, W, 3) so that the shorter side is at most LARGEST_SIDE pixels."""
    height, width = frames.shape[1:3]
    scale = LARGEST_SIDE / min(height, width)
    if scale >= 1.0:
        return frames
    import cv2

    size = (round(width * scale), round(height * scale))
    return np.stack([cv2.resize(image, size, interpolation=cv2.INTER_AREA) for image in frames])


def fitted_frames(clip: Clip, indices: NDArray[np.int64]) -> Iterator[Frames]:
    """Yield frames (1, H, W, 3) of a clip, which ascend, each shrunk before the next is decoded."""
    for image in clip.stream(indices):
        yield fit_size(image[None])


def main_camera(pool: Source) -> str:
    """Return the camera that is used when none is named: MAIN_CAMERA, or else the first one."""
    return MAIN_CAMERA if MAIN_CAMERA in pool.cameras else pool.cameras[0]


def chosen_cameras(pool: Source, wanted: tuple[str, ...]) -> tuple[str, ...]:
    """Return the cameras `wanted` of a pool; empty when none is named.

    Raises:
        ConfigError: the pool has no videos, or no camera of a name.
    """
    if not pool.cameras:
        raise ConfigError(f"'{pool.root}' has no pictures to look at.")
    for camera in wanted:
        if camera not in pool.cameras:
            raise ConfigError(
                f"The pool has no camera '{camera}'; choose from {', '.join(pool.cameras)}."
            )
    return wanted


def frame_rate(pool: Source) -> float:
    """Return the frames per second of a pool with pictures [1/s].

    Raises:
        ConfigError: the rate is not known.
    """
    if pool.fps is None:
        raise ConfigError(f"The frame rate of '{pool.root}' is not known; give it with --fps.")
    return float(pool.fps)
