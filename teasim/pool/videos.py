"""Reading and writing the mp4 files of a pool.

OpenCV reads (sequential grab is two to four times faster than seeking), ffmpeg writes through a
pipe (one thread: the same frames give the same bytes), PyAV looks at the packets of a file.
"""

import contextlib
import hashlib
import os
import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from teasim.common.errors import PoolError

# No B-frames and a key frame every 10: presentation order is file order, and readers that jump to
# a frame decode ten at most. bitexact keeps the encoder's version out of the file.
ENCODER = [
    *("-an", "-c:v", "libx264", "-pix_fmt", "yuv420p", "-preset", "veryfast", "-crf", "20"),
    *("-g", "10", "-bf", "0", "-sc_threshold", "0", "-threads", "1"),
    *("-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"),
]


@dataclass(frozen=True)
class VideoClip:
    """The frames of one demonstration seen by one camera, inside an mp4."""

    path: Path
    """The mp4."""
    start_frame: int
    """First frame of the demonstration, counted from the start of the file."""
    length: int
    """Number of frames of the demonstration."""

    def frames(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the frames `indices` as uint8 RGB (n, H, W, 3); see `read_frames`."""
        return read_frames(self, indices)

    def stream(self, indices: Sequence[int] | np.ndarray) -> Iterator[np.ndarray]:
        """Yield the frames `indices`, which ascend, in one pass; see `teasim.pool.source.Clip`."""
        return _decode_in_order(self, np.asarray(indices, dtype=np.int64))

    def packet_digests(self) -> tuple[bytes, ...]:
        """Return the SHA-256 of each encoded frame of the demonstration.

        Raises:
            PoolError: The file is missing or damaged, or ends before the demonstration does.
        """
        digests = video_content(self.path).digests
        part = digests[self.start_frame : self.start_frame + self.length]
        if len(part) < self.length:
            raise PoolError(
                f"The video '{self.path}' has {len(digests)} frames but the demonstration in it "
                f"ends at frame {self.start_frame + self.length}."
            )
        return part

    def digest(self) -> str:
        """Return a hash of the encoded frames.

        Raises:
            PoolError: The file is missing or damaged.
        """
        return hashlib.sha256(b"".join(self.packet_digests())).hexdigest()

    def mp4(self) -> bytes | None:
        """Return the file's bytes if it holds this demonstration alone, else None.

        Raises:
            PoolError: The file is missing or damaged.
        """
        alone = self.start_frame == 0 and video_content(self.path).n_frames == self.length
        return self.path.read_bytes() if alone else None


def read_frames(clip: VideoClip, indices: Sequence[int] | np.ndarray) -> np.ndarray:
    """Frames `indices` of a clip, in the order asked for.

    Args:
        clip: The demonstration's place in its mp4.
        indices: Frame numbers within the clip, in any order, repeated or not.

    Returns:
        uint8 RGB images of shape (len(indices), H, W, 3).

    Raises:
        IndexError: An index lies outside the clip.
        PoolError: The file is missing or damaged, or it ends before a frame asked for.
    """
    wanted, places = np.unique(np.asarray(indices, dtype=np.int64), return_inverse=True)
    if not wanted.size:
        raise IndexError("No frame index was given.")
    return np.stack(list(_decode_in_order(clip, wanted)))[places]


def _decode_in_order(clip: VideoClip, wanted: np.ndarray) -> Iterator[np.ndarray]:
    """Decode the ascending frame numbers `wanted`; each (H, W, 3) uint8 RGB."""
    _check_inside(clip, wanted)
    cv2 = _opencv()
    if not clip.path.is_file():
        raise PoolError(f"The video '{clip.path}' is missing.")
    capture = cv2.VideoCapture(str(clip.path), cv2.CAP_FFMPEG, [cv2.CAP_PROP_N_THREADS, 1])
    try:
        if not capture.isOpened():
            raise PoolError(f"The video '{clip.path}' cannot be opened; it is damaged.")
        first = clip.start_frame + (int(wanted[0]) if wanted.size else 0)
        if first:
            capture.set(cv2.CAP_PROP_POS_FRAMES, first)
        position, shape = first - clip.start_frame, None
        for index in wanted.tolist():
            while position <= index and capture.grab():
                position += 1
            image = capture.retrieve()[1] if position > index else None
            if image is None or shape not in (None, image.shape):
                raise PoolError(
                    f"The video '{clip.path}' is damaged or too short: frame {index} of the "
                    f"{clip.length} of this demonstration cannot be read."
                )
            shape = image.shape
            yield cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    except cv2.error as error:
        raise PoolError(f"The video '{clip.path}' cannot be decoded; it is damaged.") from error
    finally:
        capture.release()


def _check_inside(clip: VideoClip, wanted: np.ndarray) -> None:
    if wanted.size and (wanted[0] < 0 or wanted[-1] >= clip.length):
        raise IndexError(
            f"Frames {wanted[0]} to {wanted[-1]} were asked of a clip of {clip.length}."
        )


def _opencv() -> Any:
    # Damage is told in one sentence by us; ffmpeg's own lines on stderr would bury it. The level
    # is read when the first capture is made.
    os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    import cv2

    return cv2


@dataclass(frozen=True)
class VideoContent:
    """What a whole mp4 holds, in the order of presentation."""

    digests: tuple[bytes, ...]
    """SHA-256 of each encoded frame, without the container around it."""

    @property
    def n_frames(self) -> int:
        """Number of frames in the file."""
        return len(self.digests)


def video_content(path: Path) -> VideoContent:
    """The encoded frames of an mp4; nothing is decoded.

    Raises:
        PoolError: The file is missing or is no readable video.
    """
    try:
        status = path.stat()
    except OSError as error:
        raise PoolError(f"The video '{path}' is missing.") from error
    return _video_content(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=16)
def _video_content(path: Path, mtime_ns: int, size: int) -> VideoContent:
    del mtime_ns, size  # they only tell the cache that the file has changed
    packets: list[tuple[int, bytes]] = []
    with _Damage(path), _open_container(path) as container:
        stream = container.streams.video[0]
        for packet in container.demux(stream):
            if packet.size:
                pts = len(packets) if packet.pts is None else packet.pts
                packets.append((pts, hashlib.sha256(bytes(packet)).digest()))
    packets.sort(key=lambda packet: packet[0])
    return VideoContent(tuple(digest for _, digest in packets))


def count_decodable(path: Path) -> int:
    """Decode a whole mp4 strictly and count its frames.

    Raises:
        PoolError: The file is missing, or any frame has a decoding error.
    """
    if not path.is_file():
        raise PoolError(f"The video '{path}' is missing.")
    with _Damage(path), _open_container(path) as container:
        stream = container.streams.video[0]
        stream.thread_type = "NONE"
        stream.codec_context.options = {"err_detect": "explode"}
        return sum(1 for _ in container.decode(stream))


def _open_container(path: Path) -> Any:
    import av

    av.logging.set_level(av.logging.PANIC)
    return av.open(str(path))


class _Damage:
    """Turns whatever a video library throws at a damaged file into one sentence."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        del kind, trace
        # PyAV raises OSError, ValueError, EOFError and IndexError children for damaged input.
        if isinstance(error, Exception) and not isinstance(error, PoolError):
            raise PoolError(f"The video '{self.path}' is damaged and cannot be decoded.") from error


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
