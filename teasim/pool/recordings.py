"""A source of demonstrations with pictures that other tools recorded: videos, HDF5 files.

Readers of such formats make `Recording`s and hand them to `RecordedSource`.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.source import Clip
from teasim.pool.types import GroundTruth, Span

ID_DIGITS = 16
"""Hexadecimal digits of an identity, 64 bits: two of a million agree with probability 3e-8."""

Usage = Callable[[Path, Sequence[str], bool], list[str]]
"""(root, entries, keep): command lines that make other tools keep or leave out the entries."""


class Log(Protocol):
    """A log of numbers of one demonstration, read when it is asked for."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the D dimensions."""

    def read(self) -> np.ndarray:
        """Return the log, (n, D) float32.

        Raises:
            PoolError: the file is missing or damaged.
        """


@dataclass(frozen=True)
class Recording:
    """One demonstration that another tool recorded."""

    index: int
    """Number in the source, which other tools of its format know it by."""
    name: str
    """What it is called in the source."""
    length: int
    """Number of frames."""
    clips: Mapping[str, Clip]
    """Pictures by camera."""
    entry: str
    """How other tools of the format name it."""
    content: str = ""
    """Hash of its logs; empty where there are none and its pictures tell who it is."""
    labels: tuple[Span, ...] = ()
    """Logged sub-task spans in order of time."""
    task: str = ""
    """The task as a sentence; empty when it is not stored."""
    record: GroundTruth | None = None
    """What is known about it; None unless it was converted from a pool that tells."""
    logs: Mapping[str, Log] = field(default_factory=dict)
    """Logs of numbers by name."""
    identity: str = ""
    """Stored identity of a demonstration that was converted; empty when none is stored."""

    @property
    def demo_id(self) -> str:
        """The stored identity, else a hash of logs and pictures; name and number stay out.

        Raises:
            PoolError: a file is missing or damaged.
        """
        return self.identity or self.content_id()

    def content_id(self) -> str:
        """Return the hash of the logs and pictures.

        Raises:
            PoolError: a file is missing or damaged.
        """
        digests = sorted(clip.digest() for clip in self.clips.values())
        content = "\n".join([self.content, *digests])
        return hashlib.sha256(content.encode()).hexdigest()[:ID_DIGITS]

    def spans(self) -> tuple[Span, ...]:
        """Return the logged sub-task spans in order of time."""
        return self.labels

    def predicted_spans(self) -> tuple[Span, ...]:
        """Return none: no predictions are stored."""
        return ()

    def posteriors(self) -> np.ndarray | None:
        """Return None: no predictions are stored."""
        return None

    def clip(self, camera: str) -> Clip:
        """Return where the pictures by `camera` are.

        Raises:
            PoolError: the source has no such camera.
        """
        if camera not in self.clips:
            known = ", ".join(self.clips)
            raise PoolError(f"'{self.name}' has no camera '{camera}'; it has {known}.")
        return self.clips[camera]

    def log(self, name: str) -> np.ndarray:
        """Return a log of numbers, (n, D) float32.

        Raises:
            PoolError: there is no such log, or it is damaged.
        """
        if name not in self.logs:
            known = ", ".join(self.logs) or "none"
            raise PoolError(f"'{self.name}' has no log '{name}'; it has {known}.")
        return self.logs[name].read()


@dataclass(frozen=True)
class RecordedSource:
    """Demonstrations that another tool recorded; nothing is modified."""

    root: Path
    """Folder or file it was opened from."""
    fps: float
    """Frames per second."""
    cameras: tuple[str, ...]
    """Names of the cameras."""
    episodes: tuple[Recording, ...]
    """The demonstrations in the order of their index."""
    usage_lines: Usage
    """Makes the lines that `usage` returns."""
    subtasks: tuple[str, ...] = ()
    """Names of the logged sub-tasks; empty without labels."""
    notes: tuple[str, ...] = ()
    """Sentences on what is unusual but harms no demonstration."""
    has_predictions: bool = False
    """No predictions are stored."""

    @property
    def logs(self) -> dict[str, tuple[str, ...]]:
        """Names of the dimensions of each log that all demonstrations have."""
        first, *others = self.episodes
        return {
            name: log.names
            for name, log in first.logs.items()
            if all(name in o.logs and len(o.logs[name].names) == len(log.names) for o in others)
        }

    def problems(self) -> list[str]:
        """Return nothing: opening has found what shows without decoding a picture."""
        return []

    def content_hash(self) -> str:
        """Return a SHA-256 over identities, pictures and labels of all demonstrations.

        Raises:
            PoolError: a file is missing or damaged.
        """
        digest = hashlib.sha256(repr((self.fps, self.subtasks)).encode())
        for episode in self.episodes:
            pictures = [(camera, clip.digest()) for camera, clip in sorted(episode.clips.items())]
            digest.update(repr((episode.content_id(), pictures, episode.labels)).encode())
        return digest.hexdigest()

    def entries(self, indexes: Sequence[int]) -> list[str]:
        """Return how other tools of the format name the demonstrations."""
        named = {episode.index: episode.entry for episode in self.episodes}
        return [named[index] for index in indexes]

    def usage(self, indexes: Sequence[int], *, keep: bool) -> list[str]:
        """Return command lines that make other tools keep, or leave out, the demonstrations."""
        return self.usage_lines(self.root, self.entries(indexes), keep) if indexes else []


def unreadable(open_it: Callable[[], RecordedSource]) -> list[str]:
    """Open a source, decode all of its pictures, and return a sentence for each damage."""
    try:
        source = open_it()
    except PoolError as error:
        return [str(error)]
    found = []
    for episode in source.episodes:
        for camera in source.cameras:
            clip = episode.clip(camera)
            try:
                for _ in clip.stream(np.arange(clip.length)):
                    pass
            except PoolError as error:
                found.append(str(error))
    return found


def listed(folder: Path) -> list[Path]:
    """Return what is in a folder, without hidden files; nothing if it must not be looked into."""
    try:
        return sorted(path for path in folder.iterdir() if path.name[0] != ".")
    except OSError:
        return []
