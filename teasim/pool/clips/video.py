"""The frames of one demonstration inside a video file, found by time."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, Self

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.clips.decode import damage_told, nearest_frames
from teasim.pool.clips.order import ascending, digest_sample, file_version, gather
from teasim.pool.clips.probe import probe


@dataclass(frozen=True)
class VideoClip:
    """The frames of one demonstration seen by one camera, inside a video file.

    Frame i is the video frame presented nearest to `start + i / fps`. On the grid of the data set
    that is the very frame that was written there; a camera of another rate is matched by time.
    """

    path: Path
    """The video file, in any format that ffmpeg reads."""
    start: float
    """When the demonstration begins [s], counted from the first frame that the file presents."""
    length: int
    """Number of frames of the demonstration."""
    fps: float
    """Frames per second of the demonstration, whatever the rate of the file."""
    times: tuple[float, ...] | None = None
    """When each frame is presented [s], counted from `start`; None for the grid of `fps`."""

    @classmethod
    def whole(cls, path: Path) -> Self:
        """Return all frames of a file, at their own times.

        Raises:
            PoolError: The file is missing, damaged, or holds no video.
        """
        info = probe(path)
        return cls(path, 0.0, info.n_frames, info.fps, info.times)

    def frames(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the frames `indices`; see `teasim.pool.source.Clip`."""
        return gather(self, indices)

    def stream(self, indices: Sequence[int] | np.ndarray) -> Iterator[np.ndarray]:
        """Yield the frames `indices`, which ascend; see `teasim.pool.source.Clip`."""
        from av.video.reformatter import VideoReformatter

        reformatter, shape = VideoReformatter(), None
        for index, frame in self._decoded(ascending(self, indices)):
            with damage_told(self.path):
                image = _as_rgb(reformatter, frame)
            if shape not in (None, image.shape):
                raise self._absent(index)
            shape = image.shape
            yield image

    def digest(self) -> str:
        """Return a hash of the decoded pictures.

        It is made of the length, the size and the first plane (luma; codecs define it to the bit,
        unlike its conversion to RGB) of `order.DIGEST_FRAMES` frames, so it survives a new
        container and rewritten packets. Of mpeg4 and mjpeg another build of ffmpeg may decode
        other last bits.

        Raises:
            PoolError: The file is missing or damaged, or ends before the demonstration does.
        """
        return _digest(self, *file_version(self.path, "video"))

    def mp4(self) -> bytes | None:
        """Return the file's bytes if it holds exactly these frames as h264 that browsers play.

        Raises:
            PoolError: The file is missing or damaged.
        """
        info = probe(self.path)
        plays = (info.codec, info.pix_fmt) == ("h264", "yuv420p") and "mp4" in info.container
        if not plays or info.n_frames != self.length:
            return None
        late = np.abs(self._times(np.arange(self.length)) - np.asarray(info.times))
        return self.path.read_bytes() if late.max() < 0.5 / self.fps else None

    def _times(self, indices: np.ndarray) -> np.ndarray:
        """Return when the frames are presented in the file [s], (n,)."""
        times = indices / self.fps if self.times is None else np.asarray(self.times)[indices]
        return np.asarray(self.start + times)

    def _decoded(self, wanted: np.ndarray) -> Iterator[tuple[int, Any]]:
        times = self._times(wanted).tolist()
        for index, frame in zip(wanted.tolist(), nearest_frames(self.path, times), strict=True):
            if frame is None:
                raise self._absent(index)
            yield index, frame

    def _absent(self, index: int) -> PoolError:
        return PoolError(
            f"The video '{self.path}' is damaged or too short: frame {index} of the "
            f"{self.length} of this demonstration cannot be read."
        )


@lru_cache(maxsize=65536)
def _digest(clip: VideoClip, mtime_ns: int, size: int) -> str:
    del mtime_ns, size
    content = hashlib.sha256(f"video {clip.length}\n".encode())
    for _, frame in clip._decoded(digest_sample(clip.length)):
        with damage_told(clip.path):
            content.update(f"{frame.width} {frame.height}\n".encode())
            content.update(_first_plane(frame))
    return content.hexdigest()


def _first_plane(frame: Any) -> bytes:
    """Return the rows of the first plane without the padding at their ends."""
    plane, form = frame.planes[0], frame.format
    bits = form.components[0].bits if form.is_planar else form.padded_bits_per_pixel
    width = plane.width * ((bits + 7) // 8)
    rows = np.frombuffer(plane, dtype=np.uint8).reshape(plane.height, plane.line_size)
    return rows[:, :width].tobytes()


def _as_rgb(reformatter: Any, frame: Any) -> np.ndarray:
    """Return the frame as it is shown, (H, W, 3) uint8."""
    image: np.ndarray = reformatter.reformat(frame, format="rgb24", threads=1).to_ndarray()
    turns = round(frame.rotation / 90) % 4
    return np.ascontiguousarray(np.rot90(image, turns)) if turns else image
