"""Frames of segments to pooled features, or to feature maps (paper section 3.2)."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from filtering.vision.background import subtraction_named
from filtering.vision.cache import default_folder
from filtering.vision.frame_features import clip_key, look_up_or_describe, side_by_side
from filtering.vision.frames import Frames, fitted_frames, segment_indices, uniform_indices
from filtering.vision.pretrained import VGG, Backbone
from teasim.common.workers import Workers
from teasim.pool import Span
from teasim.pool.source import Clip, Source

if TYPE_CHECKING:
    from torch import Tensor

Maps = NDArray[np.float16]
"""Stride-16 feature maps of frames; half precision halves their memory.  # (n, C, h, w)"""

LITE_BACKBONE = Backbone()
MAPS_BATCH = 4
"""Frames per forward pass for feature maps, the batch of both networks."""
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
    backbone: Backbone
    """The network that looks at them."""


def segment_features(
    pool: Source,
    segments: Sequence[tuple[Span, ...]],
    *,
    cameras: Sequence[str],
    frames_per_segment: int,
    background: str,
    workers: Workers,
    backbone: Backbone = LITE_BACKBONE,
) -> list[NDArray[np.float32]]:
    """Return per demonstration features (q, F) of its segments.

    Args:
        pool: where the videos are.
        segments: the segments of each demonstration.
        cameras: cameras to use; their features are concatenated.
        frames_per_segment: largest number of frames used per segment.
        background: name of the background subtraction.
        workers: where the work runs; the result does not depend on it.
        backbone: the network that looks at the frames.

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
            backbone=backbone,
        )
        for episode, spans in zip(pool.episodes, segments, strict=True)
        for camera in cameras
    ]
    frames = look_up_or_describe(tasks, _key, describe_video, workers)
    described = [pool_over_time(task, found) for task, found in zip(tasks, frames, strict=True)]
    return side_by_side(described, len(cameras))


def describe_video(task: VideoTask) -> NDArray[np.float32]:
    """Return the features (n, F) of the n frames of `task`."""
    frames = foreground(task.clip, _frames_of(task), task.background)
    if task.backbone.name == VGG:
        from filtering.vision import vgg16

        return vgg16.describe_frames(frames, Path(task.backbone.weights))
    from filtering.vision.backbone import describe_frames

    return describe_frames(frames)


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


def segment_maps(
    clip: Clip,
    spans: tuple[Span, ...],
    count: int,
    background: str,
    backbone: Backbone = LITE_BACKBONE,
) -> list[Maps]:
    """Return per segment the feature maps (n, C, h, w) of at most `count` of its frames.

    Raises:
        ConfigError: there is no such background subtraction.
        PoolError: the video is missing or damaged.
    """
    indices = segment_indices(spans, count, exact=backbone.exact)
    used = np.unique(np.concatenate(indices))
    maps = frame_maps(foreground(clip, used, background), backbone)
    return [maps[np.searchsorted(used, chosen)] for chosen in indices]


def frame_maps(frames: Frames, backbone: Backbone = LITE_BACKBONE) -> Maps:
    """Return the stride-16 feature maps (n, C, h, w) of frames (n, H, W, 3)."""
    import torch

    from filtering.vision.determinism import one_thread

    look = _maps_of(backbone)
    with one_thread(), torch.inference_mode():
        parts = [
            look(frames[first : first + MAPS_BATCH]).numpy().astype(np.float16)
            for first in range(0, len(frames), MAPS_BATCH)
        ]
    return np.concatenate(parts)


def _maps_of(backbone: Backbone) -> "Callable[[Frames], Tensor]":
    """Return what makes the stride-16 feature maps of a batch of frames."""
    if backbone.name == VGG:
        from filtering.vision import vgg16

        return lambda frames: vgg16.feature_maps(frames, Path(backbone.weights))
    from filtering.vision.backbone import feature_maps

    return lambda frames: feature_maps(frames)[0]


def pool_over_time(task: VideoTask, frames: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (q, 2 F): mean and maximum over the frames of each segment."""
    indices = _frames_of(task)
    parts = [frames[np.searchsorted(indices, chosen)] for chosen in _indices(task)]
    return np.stack([np.concatenate([part.mean(axis=0), part.max(axis=0)]) for part in parts])


def _frames_of(task: VideoTask) -> NDArray[np.int64]:
    """Return the frames that are used, each once and in order."""
    return np.unique(np.concatenate(_indices(task)))


def _indices(task: VideoTask) -> list[NDArray[np.int64]]:
    return segment_indices(task.spans, task.frames_per_segment, exact=task.backbone.exact)


def _key(task: VideoTask) -> str:
    """Hash the decoded frames of the clip, which of them are used, and all that is done to them."""
    used = _frames_of(task).tolist()
    recipe = [task.background, OVERVIEW, task.clip.length, used]
    return clip_key(task.clip, recipe, task.backbone.recipe())
