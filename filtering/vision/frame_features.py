"""Cached features of the videos of a pool, one row per sampled frame."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from filtering.vision.cache import ArrayCache, default_folder
from filtering.vision.frames import fitted_frames, uniform_indices
from filtering.vision.pretrained import feature_recipe
from teasim.common import parallel
from teasim.common.errors import ConfigError
from teasim.common.workers import Workers
from teasim.pool.source import Clip, Demonstration

CHUNK = 64
"""Frames held in memory at a time; a multiple of the backbone's batch: it changes no bit."""


@dataclass(frozen=True)
class FrameSource:
    """Cameras and sampling rate from which features are computed."""

    cameras: tuple[str, ...]
    """Cameras whose features are concatenated."""
    rate: float = 2.5
    """Frames used per second [Hz]; 2.5 is every fourth frame at 10 frames/s. Twice as many did not
    improve the segments of tea pools."""

    def __post_init__(self) -> None:
        """Refuse a source without pictures.

        Raises:
            ConfigError: no camera is named, or the rate is not positive.
        """
        if not self.cameras:
            raise ConfigError("No camera was named; choose one or more of the pool's.")
        if not self.rate > 0.0:
            raise ConfigError(f"rate is {self.rate}; choose moments per second above 0.")

    def rate_in(self, fps: float) -> float:
        """Return the moments there are per second of a video of `fps` frames per second [Hz]."""
        return min(self.rate, fps)


@dataclass(frozen=True)
class FrameTask:
    """One video to describe; small, because it is sent to a worker process."""

    clip: Clip
    """Where the frames are."""
    camera: str
    """Name of the camera."""
    count: int
    """Number of frames to use."""
    cache_folder: Path
    """Folder of the feature cache."""


class Cached(Protocol):
    """Work whose result is cached."""

    @property
    def camera(self) -> str:
        """Name of the camera whose pictures are looked at."""

    @property
    def cache_folder(self) -> Path:
        """Folder of the feature cache."""


Task = TypeVar("Task", bound=Cached)


def sample_count(length: int, fps: float, rate: float) -> int:
    """Return the number of frames used of a video of `length` frames, 1..length."""
    return min(length, max(1, round(length * rate / fps)))


def sampled_frames(length: int, count: int) -> NDArray[np.int64]:
    """Return the numbers (count,) of the sampled frames: middles of equal parts of the video."""
    return uniform_indices(0, length, count)


def moment_of_frames(length: int, count: int) -> NDArray[np.int64]:
    """Return for each frame the nearest sample (length,); of two the later."""
    moments = sampled_frames(length, count)
    edges = (moments[:-1] + moments[1:] + 1) // 2
    return np.searchsorted(edges, np.arange(length), side="right")


def frame_tasks(
    episodes: Sequence[Demonstration], fps: float, source: FrameSource
) -> list[FrameTask]:
    """Return a task per demonstration and camera, the cameras of a demonstration side by side."""
    return [
        FrameTask(
            episode.clip(camera),
            camera,
            sample_count(episode.length, fps, source.rate),
            default_folder(),
        )
        for episode in episodes
        for camera in source.cameras
    ]


def frame_features(
    episodes: Sequence[Demonstration], fps: float, source: FrameSource, *, workers: Workers
) -> list[NDArray[np.float32]]:
    """Return per demonstration (n, F * cameras), n = sample_count(...).

    Args:
        episodes: the demonstrations.
        fps: frames per second of their videos.
        source: cameras and rate.
        workers: where the work runs; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged, or there is no such camera.
    """
    tasks = frame_tasks(episodes, fps, source)
    described = look_up_or_describe(tasks, _key, describe_moments, workers)
    return side_by_side(described, len(source.cameras))


def look_up_or_describe(
    tasks: Sequence[Task],
    key: Callable[[Task], str],
    describe: Callable[[Task], NDArray[np.float32]],
    workers: Workers,
) -> list[NDArray[np.float32]]:
    """Return what `describe` gives for each task, camera by camera, and cache it.

    Workers start only for what is not cached.
    """
    keys = [key(task) for task in tasks]
    known = {n: ArrayCache(task.cache_folder).get(keys[n]) for n, task in enumerate(tasks)}
    for camera in dict.fromkeys(task.camera for task in tasks):
        unknown = [n for n, task in enumerate(tasks) if task.camera == camera and known[n] is None]
        computed = parallel.run(
            partial(_describe_and_keep, describe),
            [(tasks[number], keys[number]) for number in unknown],
            workers=workers,
            description=f"looking at {camera}",
        )
        known.update(zip(unknown, computed, strict=True))
    return [features for features in known.values() if features is not None]


def _describe_and_keep(
    describe: Callable[[Task], NDArray[np.float32]], job: tuple[Task, str]
) -> NDArray[np.float32]:
    task, key = job
    features = describe(task)
    ArrayCache(task.cache_folder).put(key, features)
    return features


def side_by_side(videos: Sequence[NDArray[np.float32]], width: int) -> list[NDArray[np.float32]]:
    """Join every `width` consecutive videos (n, F), the cameras of one demonstration."""
    return [np.hstack(videos[first : first + width]) for first in range(0, len(videos), width)]


def describe_moments(task: FrameTask) -> NDArray[np.float32]:
    """Return the features (n, F) of the moments of `task`."""
    return describe_clip(task.clip, sampled_frames(task.clip.length, task.count))


def describe_clip(clip: Clip, wanted: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the features (n, F) of the frames `wanted` of a clip, in order of time."""
    from filtering.vision.backbone import describe_frames

    parts = []
    stream = fitted_frames(clip, wanted)
    while images := list(islice(stream, CHUNK)):
        parts.append(describe_frames(np.concatenate(images)))
    return np.concatenate(parts)


def clip_key(clip: Clip, recipe: Sequence[Any], network: Sequence[str] = ()) -> str:
    """Hash the pictures of a clip and all that is done to them (anything JSON can hold).

    Args:
        clip: where the pictures are.
        recipe: what is done to them.
        network: recipe of the network that looks at them; empty for the usual one.
    """
    content = json.dumps([clip.digest(), *(network or feature_recipe()), *recipe])
    return hashlib.sha256(content.encode()).hexdigest()


def _key(task: FrameTask) -> str:
    return clip_key(task.clip, ["moments", task.clip.length, task.count])
