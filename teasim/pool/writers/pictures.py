"""Pictures of a demonstration as an mp4: copied where it can be, else encoded anew."""

import re
from collections.abc import Callable, Sequence
from itertools import count
from pathlib import Path

import numpy as np

from teasim.common.errors import ConfigError
from teasim.pool.clips import VideoWriter, probe
from teasim.pool.source import Clip
from teasim.pool.writers.content import Content

LATE = 1e-4
"""Most that a frame may deviate from the grid of the frame rate [s]: LeRobot's tolerance."""

Seen = Callable[[int, np.ndarray], None]
"""Called with the place and picture (H, W, 3) of each frame that is written."""


def write_mp4(
    clip: Clip, frames: np.ndarray, path: Path, *, fps: float, seen: Seen | None = None
) -> bool:
    """Write the frames (n,) of a clip as h264 at `fps`, and show each of them to `seen`.

    Returns:
        True if the file that holds the demonstration was copied byte for byte.

    Raises:
        PoolError: a picture cannot be read, or the encoder fails.
    """
    if _copied(clip, frames, path, fps):
        if seen is not None:
            for place, image in enumerate(clip.stream(frames)):
                seen(place, image)
        return True
    pictures = clip.stream(frames)
    first = next(pictures)
    writer = VideoWriter(path, height=first.shape[0], width=first.shape[1], fps=fps)
    try:
        for place in count():
            if seen is not None:
                seen(place, first)
            writer.add(first)
            following = next(pictures, None)
            if following is None:
                break
            first = following
    except BaseException:
        writer.abort()
        raise
    writer.close()
    return False


def _copied(clip: Clip, frames: np.ndarray, path: Path, fps: float) -> bool:
    if not np.array_equal(frames, np.arange(clip.length)):
        return False
    stored = clip.mp4()
    if stored is None:
        return False
    path.write_bytes(stored)
    info = probe(path)
    late = np.abs(np.asarray(info.times) - np.arange(info.n_frames) / fps)
    fits = info.n_frames == len(frames) and late.max() <= LATE
    if fits and info.width % 2 == info.height % 2 == info.rotation == 0:
        return True
    path.unlink()
    return False


def encoding_note(copied: Sequence[bool]) -> tuple[str, ...]:
    """Return a sentence on videos that were not copied; none if all were."""
    n_anew = len(copied) - sum(copied)
    if not n_anew:
        return ()
    return (
        f"{n_anew} of {len(copied)} videos were encoded anew (h264), because they were no h264 "
        "files of one demonstration each at the frame rate of the data set.",
    )


def safe_names(names: Sequence[str], refused: str = "[^A-Za-z0-9_.-]") -> dict[str, str]:
    """Return for each name one without the `refused` characters, all different."""
    made: dict[str, str] = {}
    for name in names:
        plain = re.sub(refused, "_", name).strip(".") or "_"
        numbered = (f"{plain}_{number}" for number in count(2))
        while plain in made.values():
            plain = next(numbered)
        made[name] = plain
    return made


def require_one_size(content: Content) -> None:
    """Refuse a camera whose pictures differ in size between demonstrations.

    Raises:
        ConfigError: they do.
        PoolError: a picture cannot be read.
    """
    for camera in content.cameras:
        sizes: dict[tuple[int, ...], str] = {}
        for item in content.items:
            shape = item.demo.clip(camera).frames([0]).shape[1:3]
            sizes.setdefault(shape, item.demo.name)
        if len(sizes) > 1:
            told = ", ".join(f"{w} x {h} ('{name}')" for (h, w), name in sizes.items())
            raise ConfigError(
                f"The pictures of camera '{camera}' of '{content.root}' differ in size: {told}; "
                "the format needs one size per camera, --to videos and robomimic do not."
            )
