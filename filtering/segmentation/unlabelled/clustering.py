"""The segmenter `clustering`: segments of a pool without labels.

It uses the average of the finer feature map of one camera, scaled within each video to remove the
influence of camera and light. The sub-tasks found by `discovery` are named step 1, step 2, ... in
the usual order of first occurrence.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.segmentation.scaling import scaled
from filtering.segmentation.segments import Segmentation, spans_of
from filtering.segmentation.unlabelled.discovery import discover
from filtering.vision.frame_features import FrameSource, frame_features, moment_of_frames
from filtering.vision.frames import chosen_cameras, frame_rate, main_camera
from teasim.common.errors import ConfigError
from teasim.common.workers import IN_PROCESS, Workers
from teasim.pool.source import Demonstration, Source

AUTO = "auto"
"""Value of the option `subtasks` that infers the number."""
RATE = 5.0
"""Frames used per second [Hz]; with half of it, short sub-tasks are merged with others in videos
without rests, because each sub-task is a sequence of stages."""
AVERAGES = 112
"""Number of features per camera: the averages of the stride-16 map, first in its block."""


def clustering(
    pool: Source,
    *,
    workers: Workers = IN_PROCESS,
    subtasks: int | None = None,
    cameras: tuple[str, ...] = (),
) -> Segmentation:
    """Find the sub-tasks that the demonstrations of a pool share; labels are not read.

    Args:
        pool: two or more demonstrations.
        workers: where the work runs; the result does not depend on it.
        subtasks: number of sub-tasks; None infers it.
        cameras: cameras to use; empty means the main one.

    Raises:
        ConfigError: the videos are too few or too short, or there is no such camera.
        PoolError: a video is missing or damaged.
    """
    if len(pool.episodes) < 2:
        raise ConfigError(
            f"The pool '{pool.root}' has {len(pool.episodes)} demonstrations; the segmenter "
            "'clustering' needs two or more."
        )
    source = FrameSource(chosen_cameras(pool, cameras) or (main_camera(pool),), RATE)
    # Sorted, so that the order of the pool does not even change rounding.
    order = sorted(range(len(pool.episodes)), key=lambda number: pool.episodes[number].demo_id)
    episodes = [pool.episodes[number] for number in order]
    videos = looks(episodes, frame_rate(pool), source, workers=workers)
    longest = max(map(len, videos))
    if subtasks is not None and subtasks > longest:
        raise ConfigError(
            f"{subtasks} sub-tasks were asked for, but the longest video of the pool "
            f"'{pool.root}' gives only {longest} frames to compare; choose fewer."
        )
    with threadpool_limits(limits=1, user_api="blas"):  # sums get one order
        found = discover(videos, subtasks, workers=workers)
    names = tuple(f"step {number + 1}" for number in range(found.posteriors[0].shape[1]))
    spans, posteriors = {}, {}
    for place, number in enumerate(order):
        nearest = moment_of_frames(episodes[place].length, len(videos[place]))
        posteriors[number] = found.posteriors[place][nearest].astype(np.float32)
        spans[number] = spans_of(found.labels[place][nearest], posteriors[number], names)
    numbers = range(len(order))
    return Segmentation(
        names,
        tuple(spans[n] for n in numbers),
        tuple(posteriors[n] for n in numbers),
        cameras=source.cameras,
    )


def looks(
    episodes: Sequence[Demonstration], fps: float, source: FrameSource, *, workers: Workers
) -> list[NDArray[np.float64]]:
    """Return per demonstration features (n, F), each scaled within its video."""
    width = len(source.cameras)
    videos = []
    for moments in frame_features(episodes, fps, source, workers=workers):
        blocks = [camera[:, :AVERAGES] for camera in np.split(moments, width, axis=1)]
        videos.append(scaled(np.hstack(blocks), "video").astype(np.float64))
    return videos


def subtask_count(text: str) -> int | None:
    """Return the number of sub-tasks that the option gives, None for AUTO.

    Raises:
        ConfigError: it is neither AUTO nor a number.
    """
    if text == AUTO:
        return None
    if not (text.isascii() and text.isdigit() and int(text) > 0):
        raise ConfigError(f"subtasks is '{text}'; choose {AUTO} or a number from 1.")
    return int(text)
