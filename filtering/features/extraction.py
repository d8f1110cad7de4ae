"""Frames of a video to one feature vector per segment."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from filtering.background import subtraction_named
from filtering.cache import ArrayCache, default_folder
from filtering.frames import fit_size, segment_indices, uniform_indices
from teasim import parallel
from teasim.pool import Pool, Span, VideoClip, read_frames
from teasim.pool.videos import video_content

OVERVIEW = 31
"""Frames spread over the whole video from which its background is learnt."""
RECIPE = "efficientnet-lite0 b10 b15 avg max fp32, v1"
"""What is computed from a frame; changes whenever that changes, and with it every cache key."""


@dataclass(frozen=True)
class VideoTask:
    """One video to describe; small, so that it travels to a worker process."""

    clip: VideoClip
    """Where the frames are."""
    spans: tuple[Span, ...]
    """The segments [frames]."""
    frames_per_segment: int
    """Most frames looked at in a segment."""
    background: str
    """Name of the background subtraction."""
    cache_folder: Path
    """Folder of the feature cache."""


def segment_features(
    pool: Pool,
    segments: Sequence[tuple[Span, ...]],
    *,
    cameras: Sequence[str],
    frames_per_segment: int,
    background: str,
    jobs: int,
) -> list[NDArray[np.float32]]:
    """Return per demonstration (q, F): what each of its segments looks like.

    Args:
        pool: where the videos are.
        segments: the segments of each demonstration.
        cameras: whose pictures to use; their features are put side by side.
        frames_per_segment: most frames looked at in a segment.
        background: name of the background subtraction.
        jobs: worker processes; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged, or there is no such camera.
    """
    subtraction_named(background)
    tasks = [
        VideoTask(episode.video(camera), spans, frames_per_segment, background, default_folder())
        for episode, spans in zip(pool.episodes, segments, strict=True)
        for camera in cameras
    ]
    described = parallel.run(describe_video, tasks, jobs=jobs, description="looking at videos")
    return [
        np.hstack(described[first : first + len(cameras)])
        for first in range(0, len(described), len(cameras))
    ]


def describe_video(task: VideoTask) -> NDArray[np.float32]:
    """Return (q, 2 * FRAME_FEATURES): mean and maximum over time of each segment's frames."""
    per_segment = segment_indices(task.spans, task.frames_per_segment)
    indices = np.unique(np.concatenate(per_segment))
    features = _frame_features(task, indices)
    rows = [features[np.searchsorted(indices, part)] for part in per_segment]
    return np.stack([np.concatenate([part.mean(axis=0), part.max(axis=0)]) for part in rows])


def _frame_features(task: VideoTask, indices: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the features of the frames `indices`, from the cache if they are there."""
    cache = ArrayCache(task.cache_folder)
    key = _key(task, indices)
    known = cache.get(key)
    if known is not None and len(known) == len(indices):
        return known
    from filtering.backbone import describe_frames

    overview = uniform_indices(0, task.clip.length, OVERVIEW)
    wanted = np.unique(np.concatenate([indices, overview]))
    frames = fit_size(read_frames(task.clip, wanted))
    foreground = subtraction_named(task.background)(
        frames[np.searchsorted(wanted, indices)], frames[np.searchsorted(wanted, overview)]
    )
    features = describe_frames(foreground)
    cache.put(key, features)
    return features


def _key(task: VideoTask, indices: NDArray[np.int64]) -> str:
    """Hash the encoded frames of the clip, which of them are used, and all that is done to them."""
    from filtering.backbone import weights_digest

    clip = task.clip
    content = hashlib.sha256()
    for digest in video_content(clip.path).digests[clip.start_frame :][: clip.length]:
        content.update(digest)
    recipe = [RECIPE, weights_digest(), task.background, OVERVIEW, clip.length, indices.tolist()]
    content.update(json.dumps(recipe).encode())
    return content.hexdigest()
