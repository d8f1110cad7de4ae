"""Every video of a pool as small pictures, one per moment: what lies where, cell by cell."""

from collections.abc import Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from filtering.vision.frame_features import (
    CHUNK,
    FrameSource,
    FrameTask,
    clip_key,
    frame_tasks,
    look_up_or_describe,
    sampled_frames,
)
from teasim.common.workers import Workers
from teasim.pool.source import Demonstration

SHORT_SIDE = 36
"""Cells along the shorter side of a picture: a thing of a thirtieth of it fills one."""


def cell_pictures(
    episodes: Sequence[Demonstration], fps: float, source: FrameSource, *, workers: Workers
) -> list[NDArray[np.uint8]]:
    """Return per demonstration the area averages of cells, (n, H, W, 3) uint8 RGB.

    Args:
        episodes: the demonstrations.
        fps: frames per second of their videos.
        source: one camera, and the moments per second.
        workers: where the work runs; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged, or there is no such camera.
    """
    tasks = frame_tasks(episodes, fps, source)
    found = look_up_or_describe(tasks, _key, describe_cells, workers)
    return [np.asarray(cells, dtype=np.uint8) for cells in found]


def describe_cells(task: FrameTask) -> NDArray[np.float32]:
    """Return the cells (n, H, W, 3) of the moments of `task`."""
    import cv2

    stream = task.clip.stream(sampled_frames(task.clip.length, task.count))
    parts = []
    while images := list(islice(stream, CHUNK)):
        height, width = images[0].shape[:2]
        scale = SHORT_SIDE / min(height, width)
        size = (max(1, round(width * scale)), max(1, round(height * scale)))
        parts += [cv2.resize(image, size, interpolation=cv2.INTER_AREA) for image in images]
    return np.stack(parts).astype(np.uint8)


def _key(task: FrameTask) -> str:
    return clip_key(task.clip, ["cells", SHORT_SIDE, task.clip.length, task.count])
