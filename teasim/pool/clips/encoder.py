"""Writing h264 mp4 files: ffmpeg gets the frames through a pipe.

One thread and no version in the file: the same frames give the same bytes.
"""

import contextlib
import subprocess
from pathlib import Path

import numpy as np

from teasim.common.errors import PoolError

# No B-frames and a key frame every 10: presentation order is file order, and readers that jump to
# a frame decode ten at most. bitexact keeps the encoder's version out of the file.
ENCODER = [
    *("-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-preset", "veryfast", "-crf", "20"),
    *("-g", "10", "-bf", "0", "-sc_threshold", "0", "-threads", "1"),
    *("-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"),
]


class VideoWriter:
    """Encodes frames to h264 yuv420p; equal frames give equal bytes."""

    def __init__(self, path: Path, *, height: int, width: int, fps: int) -> None:
        """Start the encoder for frames of `height` x `width` pixels.

        Raises:
            PoolError: ffmpeg cannot be started.
        """
        self._path = path
        self._process = _start_encoder(path, height, width, fps)

    def add(self, image: np.ndarray) -> None:
        """Append an (H, W, 3) uint8 RGB image.

        Raises:
            PoolError: The encoder stopped, for instance because the disk is full.
        """
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(np.ascontiguousarray(image).data)
        except OSError as error:
            raise self._failure() from error

    def close(self) -> None:
        """Finish the file.

        Raises:
            PoolError: The encoder failed, for instance because the disk is full.
        """
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        if self._process.wait() != 0:
            raise self._failure()

    def abort(self) -> None:
        """Stop the encoder; what is left of the file is of no use."""
        self._process.kill()
        with contextlib.suppress(OSError):
            self._process.communicate()

    def _failure(self) -> PoolError:
        return PoolError(
            f"The encoder stopped while writing '{self._path}'; check the free space of the disk."
        )


def _start_encoder(path: Path, height: int, width: int, fps: int) -> "subprocess.Popen[bytes]":
    from imageio_ffmpeg import get_ffmpeg_exe

    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", str(fps)]
    try:
        return subprocess.Popen(
            [get_ffmpeg_exe(), "-v", "quiet", "-y", *source, "-i", "-", *ENCODER, str(path)],
            stdin=subprocess.PIPE,
        )
    except (OSError, RuntimeError) as error:
        raise PoolError(f"The encoder ffmpeg cannot be started: {error}.") from error
