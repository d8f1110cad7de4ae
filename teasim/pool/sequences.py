"""A pool of step lists without pictures: an MS-TCN folder, read as the filter reads a pool.

Data sets of what people did often come as labels alone, and so do the predictions of other people's
segmenters. Omissions, order and next steps can be judged from them all the same.
"""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from filtering.segmentation.segments import Segmentation
from teasim.common.errors import ConfigError, PoolError
from teasim.pool import Pool, Span
from teasim.pool.mstcn import PREDICTIONS, TRUTH, MSTCNFolder, is_mstcn_folder
from teasim.pool.types import spans_from_index

LABELS = ("truth", "predictions")
"""Where the segments of such a folder may come from: groundTruth/*.txt or predictions/*.txt."""


@dataclass(frozen=True)
class LabelledSequence:
    """One video of which only labels are known."""

    folder: MSTCNFolder
    """Where it is."""
    demo_id: str
    """Name of the video."""
    index: int
    """Its number in alphabetical order, from 0."""

    def spans(self) -> tuple[Span, ...]:
        """Return the true segments; none where they are not known.

        Raises:
            PoolError: the labels are damaged.
        """
        labels = self.folder.truth(self.demo_id)
        return () if labels is None else joined_spans(labels, self.folder.names)

    def predicted_spans(self) -> tuple[Span, ...]:
        """Return the predicted segments.

        Raises:
            PoolError: the labels are missing or damaged.
        """
        return joined_spans(self.folder.predictions(self.demo_id), self.folder.names)


@dataclass(frozen=True)
class SequencePool:
    """The videos of an MS-TCN folder; it is not modified."""

    root: Path
    """The folder."""
    subtasks: tuple[str, ...]
    """Names of the labels in the order of their numbers."""
    episodes: tuple[LabelledSequence, ...]
    """The videos in alphabetical order."""
    fps: float | None = None
    """Frames (lines) per second; None where nobody said, and times are counted in frames."""
    cameras: tuple[str, ...] = ()
    """None: there are no pictures."""

    @classmethod
    def open(cls, path: Path | str, fps: float | None = None) -> Self:
        """List the videos of an MS-TCN folder.

        Raises:
            ConfigError: `fps` is not above 0.
            PoolError: the folder is no MS-TCN folder, or a damaged one.
        """
        if fps is not None and not fps > 0:
            raise ConfigError(f"fps is {fps}; choose a number above 0.")
        folder = MSTCNFolder.open(path)
        episodes = [LabelledSequence(folder, name, k) for k, name in enumerate(folder.videos)]
        return cls(folder.root, folder.names, tuple(episodes), fps)

    def segments(self, source: str) -> Segmentation:
        """Return the segments of all videos from `source`, one of LABELS.

        Raises:
            ConfigError: `source` needs pictures.
            PoolError: labels are missing or damaged, or a video shows background alone.
        """
        if source not in LABELS:
            raise ConfigError(
                f"'{self.root}' has no pictures, which the segmenter '{source}' looks at; "
                f"choose {' or '.join(LABELS)}."
            )
        predicted = source == "predictions"
        spans = tuple(e.predicted_spans() if predicted else e.spans() for e in self.episodes)
        for episode, found in zip(self.episodes, spans, strict=True):
            if not found:
                raise PoolError(
                    f"The video '{episode.demo_id}' of '{self.root}' has no labelled segment, "
                    f"which the segmenter '{source}' needs."
                )
        return Segmentation(self.subtasks, spans, self._posteriors() if predicted else None)

    def content_hash(self) -> str:
        """Return a SHA-256 over the names and labels of all videos."""
        digest = hashlib.sha256("\n".join(self.subtasks).encode())
        for episode in self.episodes:
            for folder in (TRUTH, PREDICTIONS):
                path = self.root / folder / f"{episode.demo_id}.txt"
                digest.update(f"\n{folder} {episode.demo_id}\n".encode())
                digest.update(path.read_bytes() if path.exists() else b"")
        return digest.hexdigest()

    def _posteriors(self) -> tuple[NDArray[np.float32], ...] | None:
        found = [episode.folder.posteriors(episode.demo_id) for episode in self.episodes]
        known = tuple(values for values in found if values is not None)
        return known if len(known) == len(found) else None


Source = Pool | SequencePool
"""What can be filtered."""


def open_source(path: Path, fps: float | None = None) -> Source:
    """Open a pool or an MS-TCN folder.

    Args:
        path: the folder.
        fps: frames per second of an MS-TCN folder, which does not say it itself.

    Raises:
        ConfigError: `fps` is not above 0, or was given for a pool, which has its own.
        PoolError: it is neither, or damaged.
    """
    if is_mstcn_folder(path):
        return SequencePool.open(path, fps)
    if fps is not None:
        raise ConfigError(f"The pool '{path}' has its own frame rate; leave out fps.")
    return Pool.open(path)


def joined_spans(labels: NDArray[np.int64], subtasks: tuple[str, ...]) -> tuple[Span, ...]:
    """Return the segments of frame labels (n,); background within a sub-task does not end it."""
    joined: list[Span] = []
    for span in spans_from_index(labels, subtasks):
        if joined and joined[-1].subtask == span.subtask:
            joined[-1] = Span(span.subtask, joined[-1].start, span.stop)
        else:
            joined.append(span)
    return tuple(joined)
