"""What a video file holds, told from its packets; and whether all of it can be decoded."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from teasim.common.errors import PoolError
from teasim.pool.clips.decode import Video, damage_told
from teasim.pool.clips.order import file_version


@dataclass(frozen=True)
class VideoInfo:
    """What a video file holds."""

    times: tuple[float, ...]
    """When each frame is presented [s], ascending, counted from the first."""
    fps: float
    """Average number of frames per second."""
    width: int
    """Width of the frames as they are shown, after `rotation` [pixels]."""
    height: int
    """Height of the frames as they are shown, after `rotation` [pixels]."""
    codec: str
    """Name of the codec, e.g. h264, hevc, av1."""
    pix_fmt: str
    """ffmpeg's name of the pixel format, e.g. yuv420p."""
    rotation: int
    """Anticlockwise turn for showing that the file asks for [degrees]."""
    container: str
    """ffmpeg's names of the file format, e.g. 'mov,mp4,m4a,3gp,3g2,mj2'."""

    @property
    def n_frames(self) -> int:
        """Number of frames."""
        return len(self.times)

    @property
    def duration(self) -> float:
        """How long the frames are shown [s]; the last one as long as an average one."""
        return self.times[-1] + 1 / self.fps


def probe(path: Path) -> VideoInfo:
    """Look at the packets of a video and decode its first frame.

    Raises:
        PoolError: The file is missing, damaged, or holds no video.
    """
    return _probe(path, *file_version(path, "video"))


@lru_cache(maxsize=64)
def _probe(path: Path, mtime_ns: int, size: int) -> VideoInfo:
    del mtime_ns, size
    with Video(path) as video, damage_told(path):
        times = video.times()
        _, first = next(video.frames_from(0.0), (None, None))
        if first is None or not times:
            raise PoolError(f"The video '{path}' holds no frame.")
        span = times[-1] - times[0]
        turned = first.rotation % 180 != 0
        return VideoInfo(
            times=tuple(times),
            fps=(len(times) - 1) / span if span > 0 else 1 / video.gap,
            width=first.height if turned else first.width,
            height=first.width if turned else first.height,
            codec=video.stream.codec_context.codec.canonical_name,
            pix_fmt=first.format.name,
            rotation=first.rotation,
            container=video.container.format.name,
        )


def check_decodable(path: Path) -> int:
    """Decode a whole video strictly and count its frames.

    Raises:
        PoolError: The file is missing, or any frame has a decoding error.
    """
    with Video(path) as video, damage_told(path):
        video.stream.codec_context.options = {"err_detect": "explode"}
        return sum(1 for _ in video.container.decode(video.stream))
