"""A source of step lists without pictures: the videos of an MS-TCN folder.

Data sets of what people did often come as labels alone, and so do the predictions of other people's
segmenters. Omissions, order and next steps can be judged from them all the same.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from teasim.common.errors import PoolError
from teasim.pool.mstcn.folder import PREDICTIONS, TRUTH, MSTCNFolder
from teasim.pool.mstcn.labels import BACKGROUNDS
from teasim.pool.source import Clip
from teasim.pool.types import Span, spans_from_index


@dataclass(frozen=True)
class LabelledSequence:
    """One video of which only labels are known."""

    folder: MSTCNFolder
    """Where it is."""
    demo_id: str
    """Name of the video."""
    index: int
    """Its number in alphabetical order, from 0."""
    task: str = ""
    """The task is not stored."""
    record: None = None
    """Whether it is correct is not stored."""

    @property
    def name(self) -> str:
        """Name of the video."""
        return self.demo_id

    @property
    def length(self) -> int:
        """Number of labels: the true ones, or where they are not known the predicted ones.

        Raises:
            PoolError: the labels are missing or damaged.
        """
        truth = self.folder.truth(self.demo_id)
        return len(self.folder.predictions(self.demo_id) if truth is None else truth)

    def spans(self) -> tuple[Span, ...]:
        """Return the true segments; none where they are not known.

        Raises:
            PoolError: the labels are damaged.
        """
        labels = self.folder.truth(self.demo_id)
        return () if labels is None else joined_spans(labels, self.folder.names)

    def predicted_spans(self) -> tuple[Span, ...]:
        """Return the predicted segments; none where the folder has no predictions.

        Raises:
            PoolError: other videos have predictions but this one does not, or they are damaged.
        """
        if not self.folder.prediction_files:
            return ()
        return joined_spans(self.folder.predictions(self.demo_id), self.folder.names)

    def posteriors(self) -> NDArray[np.float32] | None:
        """Return the stored probability of each label in each frame, (n, T); None without.

        Raises:
            PoolError: the file is damaged.
        """
        return self.folder.posteriors(self.demo_id)

    def clip(self, camera: str) -> Clip:
        """Refuse: there are no pictures.

        Raises:
            PoolError: always.
        """
        raise PoolError(f"'{self.folder.root}' has no pictures, so it has no camera '{camera}'.")

    def log(self, name: str) -> np.ndarray:
        """Refuse: there are no logs.

        Raises:
            PoolError: always.
        """
        raise PoolError(f"'{self.folder.root}' has no logs of numbers, so it has no '{name}'.")


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
    """Frames (lines) per second; None where it is not known and times are counted in frames."""
    cameras: tuple[str, ...] = ()
    """None: there are no pictures."""

    @classmethod
    def open(
        cls,
        path: Path | str,
        fps: float | None = None,
        background: tuple[str, ...] = BACKGROUNDS,
    ) -> Self:
        """List the videos of an MS-TCN folder.

        Args:
            path: the folder.
            fps: frames (lines) per second, if known.
            background: labels of frames that belong to no sub-task.

        Raises:
            PoolError: the folder is no MS-TCN folder, or a damaged one.
        """
        folder = MSTCNFolder.open(path, background)
        episodes = [LabelledSequence(folder, name, k) for k, name in enumerate(folder.videos)]
        return cls(folder.root, folder.names, tuple(episodes), fps)

    @property
    def logs(self) -> dict[str, tuple[str, ...]]:
        """None: there are no logs of numbers."""
        return {}

    def problems(self) -> list[str]:
        """Return a sentence for each label file that is damaged."""
        found = []
        for episode in self.episodes:
            try:
                episode.spans()
                found += [] if episode.length else [f"The video '{episode.name}' has no frame."]
            except PoolError as error:
                found.append(str(error))
        return found

    @property
    def has_predictions(self) -> bool:
        """Whether predictions are stored for every video."""
        return all(e.demo_id in e.folder.prediction_files for e in self.episodes)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was decided where the files leave a doubt, one sentence each."""
        return self.episodes[0].folder.notes()

    def content_hash(self) -> str:
        """Return a SHA-256 over the names and labels of all videos."""
        digest = hashlib.sha256("\n".join(self.subtasks).encode())
        for episode in self.episodes:
            files = (episode.folder.truth_files, episode.folder.prediction_files)
            for kind, of_kind in zip((TRUTH, PREDICTIONS), files, strict=True):
                digest.update(f"\n{kind} {episode.demo_id}\n".encode())
                path = of_kind.get(episode.demo_id)
                digest.update(b"" if path is None else path.read_bytes())
        return digest.hexdigest()

    def entries(self, indexes: Sequence[int]) -> list[str]:
        """Return the names of the label files, as in the folder's splits."""
        named = []
        for index in indexes:
            episode = self.episodes[index]
            file = episode.folder.truth_files.get(episode.demo_id)
            named.append(f"{episode.demo_id}.txt" if file is None else file.name)
        return named

    def usage(self, indexes: Sequence[int], *, keep: bool) -> list[str]:
        """Return the line that makes a split of the list."""
        del indexes, keep  # the same line serves both lists
        return ["MS-TCN:    grep -v '^#' keep.txt > splits/keep.bundle"]


def joined_spans(labels: NDArray[np.int64], subtasks: tuple[str, ...]) -> tuple[Span, ...]:
    """Return the segments of frame labels (n,); background within a sub-task does not end it."""
    joined: list[Span] = []
    for span in spans_from_index(labels, subtasks):
        if joined and joined[-1].subtask == span.subtask:
            joined[-1] = Span(span.subtask, joined[-1].start, span.stop)
        else:
            joined.append(span)
    return tuple(joined)
