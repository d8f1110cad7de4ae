"""The video at rest: its features before the first segment and after each one.

Between two segments the hands are away and the effects are visible: a glowing knob, a bag in the
cup, milk. Differences between rests cancel the light and the camera of a video.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from filtering.vision.cache import default_folder
from filtering.vision.frame_features import (
    FrameSource,
    clip_key,
    describe_clip,
    look_up_or_describe,
    sample_count,
    sampled_frames,
    side_by_side,
)
from teasim.common.workers import Workers
from teasim.pool import Span
from teasim.pool.source import Clip, Demonstration

REST = 0.3
"""Frames up to this far from the border of two segments are averaged [s]; short, because the hands
soon return."""
CONSTANT = 0.1
"""Least scale of a feature [median scale]; nearly constant features must not become noise."""


@dataclass(frozen=True)
class RestTask:
    """The frames of one video at rest; small, because it is sent to a worker process."""

    clip: Clip
    """Where the frames are."""
    camera: str
    """Name of the camera."""
    frames: tuple[int, ...]
    """Numbers of the frames, in order."""
    cache_folder: Path
    """Folder of the feature cache."""


def rest_features(
    moments: NDArray[np.floating], length: int, spans: Sequence[Span], fps: float
) -> NDArray[np.float64]:
    """Return (q + 1, F): features at rest before the first of q segments and after each.

    Args:
        moments: (n, F) features of a video, see `frame_features`.
        length: frames of the video.
        spans: its q segments in order of time [frames].
        fps: frames per second of the video.
    """
    return _means(moments, rest_moments(sampled_frames(length, len(moments)), spans, fps))


def look_at_rests(
    episodes: Sequence[Demonstration],
    segments: Sequence[tuple[Span, ...]],
    fps: float,
    source: FrameSource,
    *,
    workers: Workers,
) -> list[NDArray[np.float64]]:
    """Return per demonstration `rest_features` (q + 1, F), computed from these frames alone.

    Args:
        episodes: the demonstrations.
        segments: the segments of each.
        fps: frames per second of their videos.
        source: cameras and rate.
        workers: where the work runs; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged, or there is no such camera.
    """
    tasks, places = [], []
    for episode, spans in zip(episodes, segments, strict=True):
        count = sample_count(episode.length, fps, source.rate)
        frames = sampled_frames(episode.length, count)
        chosen = rest_moments(frames, spans, fps)
        used = np.unique(np.concatenate(chosen))
        places.append([np.searchsorted(used, numbers) for numbers in chosen])
        for camera in source.cameras:
            seen = tuple(frames[used].tolist())
            tasks.append(RestTask(episode.clip(camera), camera, seen, default_folder()))
    described = look_up_or_describe(tasks, _key, describe_rests, workers)
    videos = side_by_side(described, len(source.cameras))
    return [_means(moments, chosen) for moments, chosen in zip(videos, places, strict=True)]


def changes(rests: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (q, F): change of features in each of q segments, from `rest_features` (q + 1, F)."""
    return np.diff(rests, axis=0)


def change_scales(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (F,): the scale of each feature in changes (S, F), above 0 [root mean square]."""
    scales = np.sqrt(np.square(rows).mean(axis=0))
    varying = scales[scales > 0]
    typical = float(np.median(varying)) if len(varying) else 1.0
    return np.asarray(np.hypot(scales, CONSTANT * typical))


def rest_moments(
    frames: NDArray[np.int64], spans: Sequence[Span], fps: float
) -> list[NDArray[np.int64]]:
    """Return the sampled frames at rest before the first of q segments and after each.

    Args:
        frames: (n,) numbers of the sampled frames.
        spans: q segments in order of time [frames].
        fps: frames per second.
    """
    between = [(one.stop + other.start) / 2 for one, other in pairwise(spans)]
    borders = [float(spans[0].start), *between, float(spans[-1].stop)]
    distances = [np.abs(frames + 0.5 - border) for border in borders]
    return [np.flatnonzero(far <= max(REST * fps, far.min())) for far in distances]


def describe_rests(task: RestTask) -> NDArray[np.float32]:
    """Return the features (n, F) of the frames of `task`."""
    return describe_clip(task.clip, np.array(task.frames))


def _means(
    moments: NDArray[np.floating], chosen: Sequence[NDArray[np.int64]]
) -> NDArray[np.float64]:
    return np.stack([moments[numbers].mean(axis=0, dtype=np.float64) for numbers in chosen])


def _key(task: RestTask) -> str:
    return clip_key(task.clip, ["rests", task.clip.length, list(task.frames)])
