"""Decoding video with PyAV: the frames nearest to given times, exactly, in one pass over the file.

Times are in seconds and counted from the first frame that the file presents, so an offset of the
container (`start_time`), an edit list or frames before time zero shift nothing.
"""

import bisect
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import Any, Self

from teasim.common.errors import PoolError
from teasim.pool.clips.order import MAX_SIDE

HALF = 0.55
"""Share of the gap between two frames after which the later one is taken.

A camera of half the rate of the data set is asked for times half-way between two of its frames;
above 0.5 the earlier frame is taken whichever way the time stamps were rounded.
"""
SLACK = 0.1
"""Rounding that is allowed in time stamps, as a share of the gap between two frames."""
WORTH_SEEKING = 4
"""A jump to a key frame costs about as much as decoding this many frames."""


class Video:
    """An open video file; use it in a `with` block."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            PoolError: The file is missing, is no video, or its frames are too large.
        """
        self.path = path
        self._open()

    def _open(self) -> None:
        self.container = _open_container(self.path)
        self.stream: Any = _video_stream(self.path, self.container)
        self._base = self.stream.time_base
        self._start: int = self.stream.start_time or 0
        rate = self.stream.average_rate or self.stream.guessed_rate
        self.gap = float(1 / rate) if rate else 0.04
        """Usual time between two frames [s]."""

    def __enter__(self) -> Self:
        """Return the video."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the file."""
        self.container.close()

    def time_of(self, stamped: Any) -> float:
        """Return when a frame or packet is presented [s]; it has `pts`, or at least `dts`."""
        stamp = stamped.dts if stamped.pts is None else stamped.pts
        return ((stamp or 0) - self._start) * self._base.numerator / self._base.denominator

    def key_times(self) -> list[float]:
        """Return about where the key frames lie [s], ascending; empty if the file has no index."""
        return sorted(
            (entry.timestamp - self._start) * self._base.numerator / self._base.denominator
            for entry in self.stream.index_entries
            if entry.is_keyframe
        )

    def frames_from(self, time: float) -> Iterator[Any]:
        """Yield the decoded frames from one at or before `time` on, in order of presentation.

        A jump lands on a key frame. Frames presented before it may lack what they refer to (open
        groups of pictures) and are dropped; if nothing at or before `time` is left, the jump goes
        further back, at last to the start of the file.
        """
        back = 0.0
        while time - back > 0:
            run = self._run_from_key_frame(time - back)
            first = next(run, None)
            if first is not None and self.time_of(first) <= time + SLACK * self.gap:
                return chain([first], run)
            back = max(2 * back, 1.0)
        self.container.close()
        self._open()
        return self._run(None)

    def _run_from_key_frame(self, time: float) -> Iterator[Any]:
        import av

        stamp = (time + SLACK * self.gap) * self._base.denominator / self._base.numerator
        try:
            self.container.seek(int(stamp) + self._start, stream=self.stream)
        except av.FFmpegError:
            return iter(())
        return self._run(self.stream)

    def _run(self, jumped: Any) -> Iterator[Any]:
        first = None
        for packet in self.container.demux(self.stream):
            if packet.is_corrupt:
                raise damaged(self.path)
            if first is None:
                first = self.time_of(packet)
            for frame in packet.decode():
                if jumped and (self.time_of(frame) < first or frame.is_corrupt):
                    continue
                if max(frame.width, frame.height) > MAX_SIDE:
                    raise _too_large(self.path, frame.width, frame.height)
                yield frame


def nearest_frames(path: Path, times: Sequence[float]) -> Iterator[Any]:
    """Yield for each of the ascending `times` [s] the decoded frame nearest to it.

    Yields:
        `av.VideoFrame`, or None for a time at which the file shows no frame any more.

    Raises:
        PoolError: The file is missing, is no video, or is damaged.
    """
    with Video(path) as video, damage_told(path):
        keys, run = video.key_times(), iter(())
        before: Any = None
        after: Any = None
        for time in times:
            if before is None or _skips(video, keys, video.time_of(after or before), time):
                run = video.frames_from(time)
                before, after = next(run, None), next(run, None)
            while after is not None and video.time_of(after) <= time:
                before, after = after, next(run, None)
            yield _nearer(video, before, after, time)


def _skips(video: Video, keys: list[float], position: float, time: float) -> bool:
    """Whether a jump to the last key frame before `time` is cheaper than decoding up to it."""
    place = bisect.bisect_right(keys, time)
    return place > 0 and keys[place - 1] - position > WORTH_SEEKING * video.gap


def _nearer(video: Video, before: Any, after: Any, time: float) -> Any:
    if before is None:
        return None
    past = time - video.time_of(before)
    if after is None:
        return before if past < (1 - SLACK) * video.gap else None
    return after if past > HALF * (video.time_of(after) - video.time_of(before)) else before


@contextmanager
def damage_told(path: Path) -> Iterator[None]:
    """Turn whatever a video library raises for a damaged file into one sentence."""
    try:
        yield
    except PoolError:
        raise
    except Exception as error:  # PyAV has children of OSError, ValueError, EOFError, IndexError
        raise damaged(path) from error


def damaged(path: Path) -> PoolError:
    """Return what is said about a file whose frames cannot be decoded."""
    return PoolError(f"The video '{path}' is damaged and cannot be decoded.")


def _too_large(path: Path, width: int, height: int) -> PoolError:
    return PoolError(
        f"The frames of the video '{path}' are {width} x {height} pixels; at most "
        f"{MAX_SIDE} x {MAX_SIDE} are read."
    )


def _open_container(path: Path) -> Any:
    import av

    if not path.is_file():
        raise PoolError(f"The video '{path}' is missing.")
    av.logging.set_level(av.logging.PANIC)  # ffmpeg's own lines would bury the one sentence
    try:
        return av.open(str(path))
    except Exception as error:
        raise PoolError(f"The video '{path}' cannot be opened; it is damaged.") from error


def _video_stream(path: Path, container: Any) -> Any:
    if not container.streams.video:
        container.close()
        raise PoolError(f"The file '{path}' holds no video.")
    stream = container.streams.video[0]
    width, height = stream.codec_context.width, stream.codec_context.height
    if max(width, height) > MAX_SIDE:
        container.close()
        raise _too_large(path, width, height)
    stream.thread_type = "NONE"  # the worker processes are the parallelism
    stream.codec_context.thread_count = 1
    return stream
