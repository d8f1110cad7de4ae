"""Who a demonstration is: a hash of what it holds, whatever its number or file name."""

import hashlib
from collections.abc import Mapping, Sequence

import numpy as np

ID_DIGITS = 16


def demo_id(videos: Mapping[str, Sequence[bytes]], logs: Mapping[str, np.ndarray]) -> str:
    """Content-derived identity of a demonstration.

    The encoded frames and the logs enter; file names, the container around the frames, the
    demonstration's number and every label stay out, so the identity survives copying,
    renumbering and re-labelling.

    Args:
        videos: Per camera the SHA-256 of each encoded frame.
        logs: Per column of `observation.*` and `action` the values (n, D).
    """
    content = hashlib.sha256()
    for camera in sorted(videos):
        content.update(f"video {camera} {len(videos[camera])}\n".encode())
        content.update(b"".join(videos[camera]))
    for name in sorted(logs):
        values = np.ascontiguousarray(logs[name], dtype="<f4")
        content.update(f"log {name} {values.shape}\n".encode())
        content.update(values.tobytes())
    return content.hexdigest()[:ID_DIGITS]


def is_content(column: str) -> bool:
    """Whether a data column is part of a demonstration's identity."""
    return column.startswith("observation.") or column == "action"
