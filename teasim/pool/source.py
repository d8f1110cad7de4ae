"""What can be filtered: a source of demonstrations, whatever format it is stored in.

A reader (`teasim.pool.readers`) opens a folder or file and returns a `Source`. Everything above
works on these protocols and knows no format.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from teasim.pool.types import GroundTruth, Span


class Clip(Protocol):
    """The pictures of one demonstration by one camera.

    It describes where the pictures are and holds none itself, so it travels to a worker process.
    """

    @property
    def length(self) -> int:
        """Number of frames."""

    @property
    def path(self) -> Path:
        """File that holds the pictures."""

    def frames(self, indices: Sequence[int] | np.ndarray) -> np.ndarray:
        """Return the frames `indices`, in the order asked for.

        Returns:
            uint8 RGB images of shape (len(indices), H, W, 3).

        Raises:
            IndexError: An index lies outside the demonstration.
            PoolError: The file is missing or damaged.
        """

    def stream(self, indices: Sequence[int] | np.ndarray) -> Iterator[np.ndarray]:
        """Yield the frames `indices`, which ascend, in one pass over the file.

        Yields:
            uint8 RGB images of shape (H, W, 3).

        Raises:
            IndexError: An index lies outside the demonstration.
            PoolError: The file is missing or damaged.
        """

    def digest(self) -> str:
        """Return a hexadecimal hash of the stored pictures; it is the key of cached features.

        Raises:
            PoolError: The file is missing or damaged.
        """

    def mp4(self) -> bytes | None:
        """Return an mp4 of exactly these frames that any browser plays; None if none is stored.

        Raises:
            PoolError: The file is missing or damaged.
        """


class Demonstration(Protocol):
    """One demonstration of a source."""

    @property
    def index(self) -> int:
        """Number in the source, which other tools of its format know it by."""

    @property
    def demo_id(self) -> str:
        """Stable identity: the same demonstration keeps it when others are removed."""

    @property
    def name(self) -> str:
        """What a person calls it, e.g. 'video 3'."""

    @property
    def length(self) -> int:
        """Number of frames."""

    @property
    def task(self) -> str:
        """The task as a sentence; empty when it is not stored."""

    @property
    def record(self) -> GroundTruth | None:
        """What is known about the demonstration; for scoring only, never read by a filter."""

    def spans(self) -> tuple[Span, ...]:
        """Return the logged sub-task spans in order of time; empty when none are logged.

        Raises:
            PoolError: The labels are damaged.
        """

    def predicted_spans(self) -> tuple[Span, ...]:
        """Return the spans that a segmenter stored in the source; empty when none are stored.

        Raises:
            PoolError: The labels are damaged.
        """

    def posteriors(self) -> np.ndarray | None:
        """Return the stored probability of each sub-task in each frame, (n, T); None without.

        Raises:
            PoolError: The file is damaged.
        """

    def clip(self, camera: str) -> Clip:
        """Return where the pictures by `camera` are.

        Raises:
            PoolError: The source has no such camera.
        """

    def log(self, name: str) -> np.ndarray:
        """Return the log `name`, one of `Source.logs`.

        Returns:
            (n, D) float32, a row per frame.

        Raises:
            PoolError: There is no such log, or it is damaged.
        """


class Source(Protocol):
    """Demonstrations that can be filtered; a source is never modified."""

    @property
    def root(self) -> Path:
        """Folder or file it was opened from."""

    @property
    def fps(self) -> float | None:
        """Frames per second; None where it is not known and times are counted in frames."""

    @property
    def cameras(self) -> tuple[str, ...]:
        """Names of the cameras; empty where there are no pictures."""

    @property
    def subtasks(self) -> tuple[str, ...]:
        """Names of the logged sub-tasks in the order of their numbers; empty without labels."""

    @property
    def has_predictions(self) -> bool:
        """Whether a segmenter stored the spans of every demonstration in the source."""

    @property
    def logs(self) -> Mapping[str, tuple[str, ...]]:
        """Names of the dimensions of each log of numbers that all demonstrations have.

        Logs are named as LeRobot names its features: `action`, `observation.state`,
        `observation.environment_state`, `observation.KEY` for others, `next.reward` and
        `next.success`.
        """

    @property
    def episodes(self) -> Sequence[Demonstration]:
        """The demonstrations in the order of their index."""

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences on what is unusual but harms no demonstration; verbs print them as warnings."""

    def problems(self) -> list[str]:
        """Return a sentence for each damage that shows without decoding a picture."""

    def content_hash(self) -> str:
        """Return a hash of all that a filter may read; what is known to be correct stays out.

        Raises:
            PoolError: A file is missing or damaged.
        """

    def entries(self, indexes: Sequence[int]) -> list[str]:
        """Return how other tools of the format name the demonstrations with these indexes."""

    def usage(self, indexes: Sequence[int], *, keep: bool) -> list[str]:
        """Return command lines that make other tools keep, or leave out, these demonstrations."""
