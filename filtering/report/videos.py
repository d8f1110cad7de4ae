"""The videos and pictures of the page: small files, embedded in it, or beside it where large."""

import base64
import math
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from teasim.common import parallel
from teasim.common.errors import PoolError
from teasim.common.workers import Workers
from teasim.pool.clips import VideoWriter
from teasim.pool.source import Clip

Embed = Literal["auto", "all", "none"]
"""What is embedded in the page: all, nothing, or all where it is at most EMBEDDED bytes."""

FOLDER = "videos"
"""Folder beside the page for what is not embedded."""
NAME = re.compile(r"demo_\d{6,}(_\d+){0,2}\.(mp4|jpg)")
"""Names of the files in FOLDER: demonstration, camera and, of a picture, frame."""
EMBEDDED = 12_000_000
"""Largest sum of the files that are embedded by default [bytes]. As text they are a third larger,
and a page is to stay below 20 MB."""
STORED = 100_000
"""A stored mp4 with more bytes per second than this is encoded anew; twice what the videos of a
generated pool need."""
LONGER_SIDE = 320
"""Longest side of a picture that is encoded for the page [pixels]; it is shown at up to 264."""
RATE = 10.0
"""Most pictures per second of a video that is encoded for the page [Hz]."""
QUALITY = 28
"""Constant rate factor of a video that is encoded for the page; ffmpeg's default is 23."""
STILL_SIDE = 240
"""Longest side of a picture that stands for a video until it is played [pixels]."""
STILL_QUALITY = 70
"""JPEG quality of these pictures, 0 to 100; about 5 kB each."""
MIME = {".mp4": "video/mp4", ".jpg": "image/jpeg"}
"""Type of a file by its ending, for data URLs."""


@dataclass(frozen=True)
class Wanted:
    """A video that the page shows."""

    clip: Clip
    """Where the frames are."""
    frames: tuple[int, ...]
    """Frames that are also shown as pictures, ascending."""


@dataclass(frozen=True)
class Film:
    """A video of the page: addresses are data URLs or paths beside the page."""

    video: str
    """Address of the mp4."""
    stills: Mapping[int, str]
    """Address of the picture of each frame that was asked for."""


Key = tuple[int, int]
"""Number of a demonstration, and of a camera."""


@dataclass(frozen=True)
class _Task:
    """One video to write; small, because it is sent to a worker process."""

    wanted: Wanted
    """What to write."""
    fps: float
    """Frames per second of the clip [1/s]."""
    path: Path
    """The video to write."""
    stills: tuple[Path, ...]
    """The picture of each frame to write."""


def page_films(
    wanted: Mapping[Key, Wanted], fps: float, beside: Path, embed: Embed, *, workers: Workers
) -> dict[Key, Film]:
    """Return the films for a page in the folder `beside`.

    Each video and picture is first a file in FOLDER. If they are to be embedded, they become data
    URLs and the folder is removed.

    Args:
        wanted: the videos by demonstration and camera.
        fps: frames per second of the clips.
        beside: folder of the page; what belongs to an earlier page in it is replaced.
        embed: what is embedded.
        workers: where the work runs; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged, or cannot be written.
    """
    folder = beside / FOLDER
    remove_videos(beside)
    folder.mkdir(parents=True)
    tasks = [_task(folder, key, want, fps) for key, want in wanted.items()]
    parallel.run(_write, tasks, workers=workers, description="videos of the page")
    inside = embed == "all" or (embed == "auto" and _size(tasks) <= EMBEDDED)
    address = _data_url if inside else _beside
    films = {
        key: Film(
            address(task.path),
            dict(zip(task.wanted.frames, map(address, task.stills), strict=True)),
        )
        for key, task in zip(wanted, tasks, strict=True)
    }
    if inside:
        remove_videos(beside)
    return films


def remove_videos(beside: Path) -> None:
    """Remove the videos of an earlier page in the folder `beside`."""
    shutil.rmtree(beside / FOLDER, ignore_errors=True)


def foreign_videos(beside: Path) -> list[str]:
    """Return the names of files in FOLDER that no page put there."""
    folder = beside / FOLDER
    names = sorted(path.name for path in folder.iterdir()) if folder.is_dir() else []
    return [f"{FOLDER}/{name}" for name in names if not NAME.fullmatch(name)]


def encode(clip: Clip, fps: float, path: Path) -> None:
    """Write a clip as a small h264 mp4, one picture in memory at a time."""
    step = max(1, math.ceil(fps / RATE - 1e-6))
    writer = None
    for image in clip.stream(np.arange(0, clip.length, step)):
        small = _shrunk(image, LONGER_SIDE)
        if writer is None:
            height, width = small.shape[:2]
            writer = VideoWriter(path, height=height, width=width, fps=fps / step, quality=QUALITY)
        writer.add(small)
    if writer is not None:
        writer.close()


def _task(folder: Path, key: Key, wanted: Wanted, fps: float) -> _Task:
    name = "demo_{:06d}_{}".format(*key)
    stills = tuple(folder / f"{name}_{frame}.jpg" for frame in wanted.frames)
    return _Task(wanted, fps, folder / f"{name}.mp4", stills)


def _write(task: _Task) -> None:
    """Copy the stored mp4 if it is small and plays in a browser; otherwise encode the clip."""
    clip = task.wanted.clip
    seconds = clip.length / task.fps
    # The size of the file comes first: a large one, of many demonstrations, is not read.
    fits = clip.path.is_file() and clip.path.stat().st_size <= STORED * seconds
    stored = clip.mp4() if fits else None
    if stored is None:
        encode(clip, task.fps, task.path)
    else:
        task.path.write_bytes(stored)
    if task.stills:
        images = clip.stream(np.asarray(task.wanted.frames))
        for path, image in zip(task.stills, images, strict=True):
            write_still(path, image)


def write_still(path: Path, image: NDArray[np.uint8]) -> None:
    """Write an (H, W, 3) RGB image as a small JPEG.

    Raises:
        PoolError: it cannot be written.
    """
    import cv2

    small = cv2.cvtColor(_shrunk(image, STILL_SIDE), cv2.COLOR_RGB2BGR)
    done, content = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, STILL_QUALITY])
    if not done:
        raise PoolError(f"The picture '{path}' cannot be encoded.")
    path.write_bytes(content.tobytes())


def _shrunk(image: NDArray[np.uint8], longest: int) -> NDArray[np.uint8]:
    """Return an image (H, W, 3) whose longer side is at most `longest` pixels."""
    import cv2

    height, width = image.shape[:2]
    scale = min(1.0, longest / max(height, width))
    size = max(1, round(width * scale)), max(1, round(height * scale))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _size(tasks: Sequence[_Task]) -> int:
    return sum(path.stat().st_size for task in tasks for path in (task.path, *task.stills))


def _beside(path: Path) -> str:
    return f"{FOLDER}/{path.name}"


def _data_url(path: Path) -> str:
    return f"data:{MIME[path.suffix]};base64," + base64.b64encode(path.read_bytes()).decode("ascii")
