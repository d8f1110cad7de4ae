"""Frames of segments to pooled features, or to feature maps (paper section 3.2)."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from filtering.vision.background import subtraction_named
from filtering.vision.cache import default_folder
from filtering.vision.frame_features import clip_key, look_up_or_describe, side_by_side
from filtering.vision.frames import Frames, fitted_frames, segment_indices, uniform_indices
from teasim.common.workers import Workers
from teasim.pool import Span
from teasim.pool.source import Clip, Source

Maps = NDArray[np.float16]
"""Stride-16 feature maps of frames; half precision halves their memory.  # (n, C, h, w)"""

OVERVIEW = 31
"""Number of frames over the whole video from which its background is estimated."""


@dataclass(frozen=True)
class VideoTask:
    """One video to describe; small, because it is sent to a worker process."""

    clip: Clip
    """Where the frames are."""
    camera: str
    """Name of the camera."""
    spans: tuple[Span, ...]
    """The segments [frames]."""
    frames_per_segment: int
    """Largest number of frames used per segment."""
    background: str
    """Name of the background subtraction."""
    cache_folder: Path
    """Folder of the feature cache."""


def segment_features(
    pool: Source,
    segments: Sequence[tuple[Span, ...]],
    *,
    cameras: Sequence[str],
    frames_per_segment: int,
    background: str,
    workers: Workers,
) -> list[NDArray[np.float32]]:
    """Return per demonstration features (q, F) of its segments.

    Args:
        pool: where the videos are.
        segments: the segments of each demonstration.
        cameras: cameras to use; their features are concatenated.
        frames_per_segment: largest number of frames used per segment.
        background: name of the background subtraction.
        workers: where the work runs; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged, or there is no such camera.
    """
    subtraction_named(background)
    tasks = [
        VideoTask(
            clip=episode.clip(camera),
            camera=camera,
            spans=spans,
            frames_per_segment=frames_per_segment,
            background=background,
            cache_folder=default_folder(),
        )
        for episode, spans in zip(pool.episodes, segments, strict=True)
        for camera in cameras
    ]
    frames = look_up_or_describe(tasks, _key, describe_video, workers)
    described = [pool_over_time(task, found) for task, found in zip(tasks, frames, strict=True)]
    return side_by_side(described, len(cameras))


def describe_video(task: VideoTask) -> NDArray[np.float32]:
    """Return the features (n, FRAME_FEATURES) of the n frames of `task`."""
    from filtering.vision.backbone import describe_frames

    return describe_frames(foreground(task.clip, _frames_of(task), task.background))


def foreground(clip: Clip, indices: NDArray[np.int64], background: str) -> Frames:
    """Return frames of a clip (n, H, W, 3), `indices` in order of time, without the background.

    Raises:
        ConfigError: there is no such background subtraction.
        PoolError: the video is missing or damaged.
    """
    overview = uniform_indices(0, clip.length, OVERVIEW)
    wanted = np.unique(np.concatenate([indices, overview]))
    frames = np.concatenate(list(fitted_frames(clip, wanted)))
    return subtraction_named(background)(
        frames[np.searchsorted(wanted, indices)], frames[np.searchsorted(wanted, overview)]
    )


def segment_maps(clip: Clip, spans: tuple[Span, ...], count: int, background: str) -> list[Maps]:
    """Return per segment the feature maps (n, C, h, w) of at most `count` of its frames.

    Raises:
        ConfigError: there is no such background subtraction.
        PoolError: the video is missing or damaged.
    """
    indices = segment_indices(spans, count)
    used = np.unique(np.concatenate(indices))
    maps = frame_maps(foreground(clip, used, background))
    return [maps[np.searchsorted(used, chosen)] for chosen in indices]


def frame_maps(frames: Frames) -> Maps:
    """Return the stride-16 feature maps (n, C, h, w) of frames (n, H, W, 3)."""
    import torch

    from filtering.vision.backbone import BATCH, feature_maps
    from filtering.vision.determinism import one_thread

    with one_thread(), torch.inference_mode():
        parts = [
            feature_maps(frames[first : first + BATCH])[0].numpy().astype(np.float16)
            for first in range(0, len(frames), BATCH)
        ]
    return np.concatenate(parts)


def pool_over_time(task: VideoTask, frames: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (q, 2 * FRAME_FEATURES): mean and maximum over the frames of each segment."""
    indices = _frames_of(task)
    parts = [
        frames[np.searchsorted(indices, chosen)]
        for chosen in segment_indices(task.spans, task.frames_per_segment)
    ]
    return np.stack([np.concatenate([part.mean(axis=0), part.max(axis=0)]) for part in parts])


def _frames_of(task: VideoTask) -> NDArray[np.int64]:
    """Return the frames that are used, each once and in order."""
    return np.unique(np.concatenate(segment_indices(task.spans, task.frames_per_segment)))


def _key(task: VideoTask) -> str:
    """Hash the decoded frames of the clip, which of them are used, and all that is done to them."""
    used = _frames_of(task).tolist()
    return clip_key(task.clip, [task.background, OVERVIEW, task.clip.length, used])
