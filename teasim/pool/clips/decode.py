"""Decoding video with PyAV: the frames nearest to given times, exactly, in one pass over the file.

Times are in seconds and counted from the first frame that the file presents, so an offset of the
container (`start_time`), an edit list or frames before time zero shift nothing.
"""

import bisect
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import Any, Self

from teasim.common.errors import PoolError
from teasim.pool.clips.order import check_size, file_version

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
        self.counted = self.stream.start_time is None or self.container.format.name == "avi"
        """Whether the format stores no times of presentation, so that frames are counted."""

    def __enter__(self) -> Self:
        """Return the video."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close the file."""
        self.container.close()

    def times(self) -> list[float]:
        """Read all packets and return when each frame is presented [s], ascending."""
        shown = [
            packet
            for packet in self.container.demux(self.stream)
            if packet.size and not packet.is_discard
        ]
        if self.counted:
            return [place * self.gap for place in range(len(shown))]
        return sorted(self._time_of(packet) for packet in shown)

    def key_times(self) -> list[float]:
        """Return about where the key frames lie [s], ascending; empty if the file has no index."""
        if self.counted:
            return []
        keys = (entry.timestamp for entry in self.stream.index_entries if entry.is_keyframe)
        return sorted(self._seconds(stamp) for stamp in keys)

    def frames_from(self, time: float) -> Iterator[tuple[float, Any]]:
        """Yield time and decoded frame from one at or before `time` on, in order of presentation.

        A jump lands on a key frame. Frames presented before it may lack what they refer to (open
        groups of pictures) and are dropped; if nothing at or before `time` is left, the jump goes
        further back, at last to the start of the file.
        """
        back = 0.0
        while time - back > 0 and not self.counted:
            run = self._run_from_key_frame(time - back)
            first = next(run, None)
            if first is not None and first[0] <= time + SLACK * self.gap:
                return chain([first], run)
            back = max(2 * back, 1.0)
        self.container.close()
        self._open()
        run = self._run(jumped=False)
        if self.counted:
            return ((place * self.gap, frame) for place, (_, frame) in enumerate(run))
        return run

    def _run_from_key_frame(self, time: float) -> Iterator[tuple[float, Any]]:
        import av

        stamp = (time + SLACK * self.gap) * self._base.denominator / self._base.numerator
        try:
            self.container.seek(int(stamp) + self._start, stream=self.stream)
        except av.FFmpegError:
            return iter(())
        return self._run(jumped=True)

    def _run(self, *, jumped: bool) -> Iterator[tuple[float, Any]]:
        first = None
        for packet in self.container.demux(self.stream):
            if packet.is_corrupt:
                raise damaged(self.path)
            if first is None:
                first = self._time_of(packet)
            for frame in packet.decode():
                time = self._time_of(frame)
                if jumped and (time < first or frame.is_corrupt):
                    continue
                check_size(self.path, frame.width, frame.height)
                yield time, frame

    def _time_of(self, stamped: Any) -> float:
        """Return when a frame or packet is presented [s]."""
        return self._seconds(stamped.dts if stamped.pts is None else stamped.pts)

    def _seconds(self, stamp: int | None) -> float:
        return ((stamp or 0) - self._start) * self._base.numerator / self._base.denominator


def nearest_frames(path: Path, times: Sequence[float]) -> Iterator[Any]:
    """Yield for each of the ascending `times` [s] the decoded frame nearest to it.

    Yields:
        `av.VideoFrame`, or None for a time at which the file shows no frame any more.

    Raises:
        PoolError: The file is missing, is no video, or is damaged.
    """
    with Video(path) as video, damage_told(path):
        keys = _key_times(path, *file_version(path, "video"))
        run: Iterator[tuple[float, Any]] = iter(())
        before: tuple[float, Any] | None = None
        after: tuple[float, Any] | None = None
        for time in times:
            if before is None or _skips(video, keys, (after or before)[0], time):
                run = video.frames_from(time)
                before, after = next(run, None), next(run, None)
            while after is not None and after[0] <= time:
                before, after = after, next(run, None)
            yield None if before is None else _nearer(video, before, after, time)


@lru_cache(maxsize=32)
def _key_times(path: Path, mtime_ns: int, size: int) -> list[float]:
    """Return `Video.key_times`, which takes longer than opening a long file."""
    del mtime_ns, size
    with Video(path) as video:
        return video.key_times()


def _skips(video: Video, keys: list[float], position: float, time: float) -> bool:
    """Whether a jump to the last key frame before `time` is cheaper than decoding up to it."""
    place = bisect.bisect_right(keys, time)
    return place > 0 and keys[place - 1] - position > WORTH_SEEKING * video.gap


def _nearer(
    video: Video, before: tuple[float, Any], after: tuple[float, Any] | None, time: float
) -> Any:
    past = time - before[0]
    if after is None:
        return before[1] if past < (1 - SLACK) * video.gap else None
    return after[1] if past > HALF * (after[0] - before[0]) else before[1]


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
    import av

    cover = av.stream.Disposition.attached_pic
    streams = [stream for stream in container.streams.video if not stream.disposition & cover]
    if not streams:
        raise PoolError(f"The file '{path}' holds no video.")
    stream = streams[0]
    if stream.codec_context is None:
        raise PoolError(
            f"The video '{path}' is damaged or in a codec that PyAV cannot decode; "
            f"teasim doctor tells which ones it can."
        )
    check_size(path, stream.codec_context.width, stream.codec_context.height)
    stream.thread_type = "NONE"  # the worker processes are the parallelism
    stream.codec_context.thread_count = 1
    return stream
