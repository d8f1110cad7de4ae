"""Writing h264 mp4 files: ffmpeg gets the frames through a pipe.

One thread and no version in the file: the same frames give the same bytes.
"""

import contextlib
import subprocess
import tempfile
from fractions import Fraction
from pathlib import Path
from typing import IO

import numpy as np

from teasim.common.errors import PoolError

# No B-frames and a key frame every 10: presentation order is file order, and readers that jump to
# a frame decode ten at most. bitexact keeps the encoder's version out of the file.
ENCODER = [
    *("-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-preset", "veryfast"),
    *("-g", "10", "-bf", "0", "-sc_threshold", "0", "-threads", "1"),
    *("-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"),
]
QUALITY = 20
"""Constant rate factor of stored videos; ffmpeg's default, 23, blurs small objects."""


class VideoWriter:
    """Encodes frames to h264 yuv420p; equal frames give equal bytes.

    That format needs even sizes: of an odd one the last row or column is repeated.
    """

    def __init__(
        self, path: Path, *, height: int, width: int, fps: float, quality: int = QUALITY
    ) -> None:
        """Start the encoder for frames of `height` x `width` pixels.

        Args:
            path: The file to write.
            height: Height of the frames [pixels].
            width: Width of the frames [pixels].
            fps: Frames per second.
            quality: Constant rate factor of libx264, 0 (lossless) to 51.

        Raises:
            PoolError: ffmpeg cannot be started.
        """
        self._path = path
        self._shape = (height, width, 3)
        self._padding = ((0, height % 2), (0, width % 2), (0, 0))
        self._messages = tempfile.TemporaryFile()  # noqa: SIM115  (closed with the writer)
        size = f"{width + width % 2}x{height + height % 2}"
        rate = str(Fraction(fps).limit_denominator(1001))
        source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", rate, "-i", "-"]
        self._process = _start_ffmpeg(
            [*source, *ENCODER, "-crf", str(quality), str(path)], self._messages
        )

    def add(self, image: np.ndarray) -> None:
        """Append an (H, W, 3) uint8 RGB image.

        Raises:
            PoolError: The encoder stopped, for instance because the disk is full.
            ValueError: The image has another shape or type.
        """
        if image.shape != self._shape or image.dtype != np.uint8:
            raise ValueError(f"A frame is {image.dtype} {image.shape}, not uint8 {self._shape}.")
        assert self._process.stdin is not None
        padded = np.pad(image, self._padding, mode="edge") if np.any(self._padding) else image
        try:
            self._process.stdin.write(np.ascontiguousarray(padded).data)
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
        self._messages.close()

    def abort(self) -> None:
        """Stop the encoder; what is left of the file is of no use."""
        self._process.kill()
        with contextlib.suppress(OSError):
            self._process.communicate()
        self._messages.close()

    def _failure(self) -> PoolError:
        """Return what is said, with the last line that ffmpeg wrote."""
        code = self._process.wait()
        reason = f"it ended with code {code}"
        if not self._messages.closed:
            self._messages.seek(0)
            lines = self._messages.read().decode(errors="replace").strip().splitlines()
            reason = lines[-1].strip().rstrip(".") if lines else reason
        return PoolError(f"The encoder stopped while writing '{self._path}': {reason}.")


def _start_ffmpeg(arguments: list[str], messages: IO[bytes]) -> "subprocess.Popen[bytes]":
    from imageio_ffmpeg import get_ffmpeg_exe

    try:
        return subprocess.Popen(
            [get_ffmpeg_exe(), "-v", "error", "-y", *arguments],
            stdin=subprocess.PIPE,
            stderr=messages,
        )
    except (OSError, RuntimeError) as error:
        raise PoolError(f"The encoder ffmpeg cannot be started: {error}.") from error
