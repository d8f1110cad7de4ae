"""Can this machine read the codecs that people's videos come in?"""

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from teasim.pool.clips.probe import check_decodable
from teasim.pool.clips.video import VideoClip

ENCODERS: Mapping[str, tuple[str, Mapping[str, str]]] = MappingProxyType(
    {
        "h264": ("libx264", {}),
        "hevc": ("libx265", {"x265-params": "log-level=none"}),
        "av1": ("libsvtav1", {"preset": "12", "svtav1-params": "lp=1"}),
        "vp9": ("libvpx-vp9", {"deadline": "realtime"}),
        "mpeg4": ("mpeg4", {}),
    }
)
"""Per codec the encoder that makes the video it is tried with, and the encoder's options."""

N_FRAMES = 5
"""Frames of the clip that every codec encodes and decodes."""
SIDE = 64  # pixels; libsvtav1 makes nothing smaller
LARGEST_ERROR = 20.0  # grey levels of 255, of single grey frames
STEP = 40  # grey levels between two frames


def probe_codecs() -> dict[str, str | None]:
    """Write and read a tiny video of every codec that PyAV can write here.

    Returns:
        Per codec what went wrong, in a few words; None where all frames came back. A codec is
        left out if its encoder is missing and its decoder is not.
    """
    import av

    present = av.codecs_available
    lacking = {
        codec: "PyAV was built without its decoder" for codec in ENCODERS if codec not in present
    }
    with tempfile.TemporaryDirectory() as folder:
        tried = {
            codec: _problem(codec, Path(folder) / f"{codec}.mp4")
            for codec, (encoder, _) in ENCODERS.items()
            if codec in present and encoder in present
        }
    return lacking | tried


def _problem(codec: str, path: Path) -> str | None:
    try:
        _encode(path, *ENCODERS[codec])
        clip = VideoClip.whole(path)
        levels = clip.frames(range(clip.length)).mean(axis=(1, 2, 3))
        complete = check_decodable(path) == clip.length == N_FRAMES
    except Exception as error:  # whatever a codec may throw is the finding
        return f"{type(error).__name__}: {error}"
    if not complete:
        return f"{clip.length} of {N_FRAMES} frames came back"
    error_found = float(np.abs(levels - STEP * np.arange(N_FRAMES)).max())
    return None if error_found < LARGEST_ERROR else f"frames are off by {error_found:.0f} levels"


def _encode(path: Path, encoder: str, options: Mapping[str, str]) -> None:
    import av

    os.environ.setdefault("SVT_LOG", "0")  # libsvtav1 would describe itself on stderr
    with av.open(str(path), "w") as container:
        stream: Any = container.add_stream(encoder, 10, options=dict(options))
        stream.width, stream.height, stream.pix_fmt = SIDE, SIDE, "yuv420p"
        for place in range(N_FRAMES):
            image = np.full((SIDE, SIDE, 3), STEP * place, np.uint8)
            frame = av.VideoFrame.from_ndarray(image, format="rgb24")
            frame.pts = place
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
