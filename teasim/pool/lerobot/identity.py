"""Who a demonstration is: a hash of what it holds, whatever its number or file name."""

import hashlib
from collections.abc import Mapping

import numpy as np

ID_DIGITS = 16

ID_PREFIX = "v2-"
"""Tells how an identity was made; one without it hashed packets and cannot be made again."""


def demo_id(videos: Mapping[str, str], logs: Mapping[str, np.ndarray]) -> str:
    """Content-derived identity of a demonstration.

    The decoded frames and the logs enter; file names, the container and the packets around the
    frames, the demonstration's number and every label stay out, so the identity survives copying,
    merging, renumbering and re-labelling.

    Args:
        videos: Per camera the digest of the frames (`teasim.pool.source.Clip.digest`).
        logs: Per column of `observation.*` and `action` the values (n, D).
    """
    content = hashlib.sha256()
    for camera in sorted(videos):
        content.update(f"video {camera} {videos[camera]}\n".encode())
    for name in sorted(logs):
        values = np.ascontiguousarray(logs[name], dtype="<f4")
        content.update(f"log {name} {values.shape}\n".encode())
        content.update(values.tobytes())
    return ID_PREFIX + content.hexdigest()[:ID_DIGITS]


def is_content(column: str) -> bool:
    """Whether a data column is part of a demonstration's identity."""
    return column.startswith("observation.") or column == "action"
