"""Videos that number their frames: blocks of black and white that survive any codec."""

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np

BITS = 8
HEIGHT, WIDTH = 48, 64


def bars(number: int, height: int = HEIGHT, width: int = WIDTH) -> np.ndarray:
    """The picture of frame `number` (below 256): its bits above, their inverse below; RGB."""
    bits = (number >> np.arange(BITS)) & 1
    cells = np.stack([bits[:4], bits[4:], 1 - bits[:4], 1 - bits[4:]])
    rows = np.arange(height) * 4 // height
    columns = np.arange(width) * 4 // width
    grey = (16 + 220 * cells[rows][:, columns]).astype(np.uint8)
    return np.repeat(grey[:, :, None], 3, axis=2)


def number(image: np.ndarray) -> int:
    """Read the number of a frame back; a picture between two numbers fails."""
    height, width = image.shape[:2]
    rows = ((np.arange(4) + 0.5) * height / 4).astype(int)
    columns = ((np.arange(4) + 0.5) * width / 4).astype(int)
    levels = image.astype(float).mean(axis=2)[np.ix_(rows, columns)]
    assert (np.abs(levels - 128) > 60).all(), levels
    bits = (levels > 128).astype(int)
    np.testing.assert_array_equal(bits[:2], 1 - bits[2:])
    return int((bits[:2].ravel() << np.arange(BITS)).sum())


def numbers(images: Iterable[np.ndarray]) -> list[int]:
    """Read the numbers of several frames."""
    return [number(image) for image in images]


def write(
    path: Path,
    shown: Sequence[int],
    codec: str = "libx264",
    *,
    rate: Fraction | int = 10,
    pix_fmt: str = "yuv420p",
    options: Mapping[str, str] | None = None,
    stamps: Sequence[int] | None = None,
    **more: Any,
) -> Path:
    """Write a video of the frames `shown`; frame i is presented at stamps[i] / rate.

    Args:
        more: `rotation` [degrees], `container_options`, `size` as (height, width).
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    height, width = more.get("size", (HEIGHT, WIDTH))
    rate = Fraction(rate)
    with av.open(str(path), "w", container_options=more.get("container_options", {})) as box:
        stream: Any = box.add_stream(codec, rate, options=dict(options or {}))
        stream.height, stream.width, stream.pix_fmt = height, width, pix_fmt
        stream.thread_type = "NONE"
        if "rotation" in more:
            stream.set_display_rotation(more["rotation"])
        for place, which in enumerate(shown):
            frame = av.VideoFrame.from_ndarray(bars(which, height, width), format="rgb24")
            frame.pts = place if stamps is None else stamps[place]
            frame.time_base = 1 / rate
            box.mux(stream.encode(frame.reformat(format=pix_fmt)))
        box.mux(stream.encode())
    return path
