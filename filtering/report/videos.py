"""The videos of the page: small mp4 files, embedded in it, or beside it where they are many."""

import base64
import math
import re
import shutil
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from teasim.common import parallel
from teasim.common.workers import Workers
from teasim.pool.clips import VideoWriter
from teasim.pool.source import Clip

FOLDER = "videos"
"""Folder beside the page for videos that are not embedded."""
NAME = re.compile(r"demo_\d{6,}\.mp4")
"""Names of the files in FOLDER."""
EMBEDDED = 20_000_000
"""Largest sum of the videos that are embedded [bytes]; browsers open larger pages slowly."""
STORED = 100_000
"""A stored mp4 with more bytes per second than this is encoded anew; twice what the videos of a
generated pool need."""
LONGER_SIDE = 320
"""Longest side of a picture that is encoded for the page [pixels]; it is shown at up to 264."""
RATE = 10.0
"""Most pictures per second of a video that is encoded for the page [Hz]."""
QUALITY = 28
"""Constant rate factor of a video that is encoded for the page; ffmpeg's default is 23."""


@dataclass(frozen=True)
class _Task:
    """One video to write; small, because it is sent to a worker process."""

    clip: Clip
    """Where the frames are."""
    fps: float
    """Frames per second of the clip [1/s]."""
    path: Path
    """The file to write."""


def page_videos(
    clips: Mapping[int, Clip], fps: float, beside: Path, *, workers: Workers
) -> dict[int, str]:
    """Return by number the address of a video for a page in the folder `beside`.

    Each video is first a file in FOLDER. Up to EMBEDDED bytes in all become data URLs and the
    folder is removed; more stay where they are.

    Args:
        clips: the demonstrations by number.
        fps: frames per second of the clips.
        beside: folder of the page; an earlier page's videos in it are replaced.
        workers: where the work runs; the result does not depend on it.

    Raises:
        PoolError: a video is missing or damaged, or cannot be written.
    """
    folder = beside / FOLDER
    remove_videos(beside)
    folder.mkdir(parents=True)
    paths = {number: folder / f"demo_{number:06d}.mp4" for number in clips}
    tasks = [_Task(clip, fps, paths[number]) for number, clip in clips.items()]
    parallel.run(_write, tasks, workers=workers, description="videos of the page")
    if sum(path.stat().st_size for path in paths.values()) > EMBEDDED:
        return {number: f"{FOLDER}/{path.name}" for number, path in paths.items()}
    embedded = {number: _data_url(path.read_bytes()) for number, path in paths.items()}
    remove_videos(beside)
    return embedded


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
    import cv2

    step = max(1, math.ceil(fps / RATE - 1e-6))
    writer = None
    for image in clip.stream(np.arange(0, clip.length, step)):
        height, width = image.shape[:2]
        scale = min(1.0, LONGER_SIDE / max(height, width))
        size = max(1, round(width * scale)), max(1, round(height * scale))
        small = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
        if writer is None:
            writer = VideoWriter(
                path, height=size[1], width=size[0], fps=fps / step, quality=QUALITY
            )
        writer.add(small)
    if writer is not None:
        writer.close()


def _write(task: _Task) -> None:
    """Copy the stored mp4 if it is small and plays in a browser; otherwise encode the clip."""
    seconds = task.clip.length / task.fps
    # The size of the file comes first: a large one, of many demonstrations, is not read.
    fits = task.clip.path.is_file() and task.clip.path.stat().st_size <= STORED * seconds
    stored = task.clip.mp4() if fits else None
    if stored is None:
        encode(task.clip, task.fps, task.path)
    else:
        task.path.write_bytes(stored)


def _data_url(video: bytes) -> str:
    return "data:video/mp4;base64," + base64.b64encode(video).decode("ascii")
