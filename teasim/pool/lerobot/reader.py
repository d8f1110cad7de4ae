"""Reading any well-formed LeRobotDataset v3.0; what only our pools have is optional."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.clips import VideoClip
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import as_numpy, read_column
from teasim.pool.lerobot.identity import demo_id, is_content
from teasim.pool.lerobot.metadata import Metadata, Row, read_metadata
from teasim.pool.selection import lerobot_usage
from teasim.pool.types import GroundTruth, MistakeSpan, Span, spans_from_index


class Episode:
    """One demonstration; its logs and frames are read when asked for."""

    def __init__(self, meta: Metadata, row: Row, first_row: int) -> None:
        """Describe the demonstration of `row`, whose log starts at `first_row` of its file."""
        self._meta = meta
        self.row = row
        """The demonstration's row of the episodes table, without its statistics."""
        self._first_row = first_row

    def __repr__(self) -> str:
        """Number and length."""
        return f"Episode(index={self.index}, length={self.length})"

    @property
    def index(self) -> int:
        """Number of the demonstration in its pool."""
        return int(self.row["episode_index"])

    @property
    def name(self) -> str:
        """What a person calls it."""
        return f"video {self.index}"

    @property
    def length(self) -> int:
        """Number of frames."""
        return int(self.row["length"])

    @property
    def task(self) -> str:
        """The task as a sentence; empty when the data set names none."""
        tasks = self.row.get("tasks")
        return str(tasks[0]) if tasks else ""

    @cached_property
    def demo_id(self) -> str:
        """Stable identity: the stored one, else computed from the content.

        Raises:
            PoolError: It must be computed and a file is missing or damaged.
        """
        return self.row.get("teasim/demo_id") or self.content_id()

    def content_id(self) -> str:
        """Identity computed from the decoded frames and the logs on disk.

        Raises:
            PoolError: A file is missing or damaged, or ends too early.
        """
        videos = {camera: self.clip(camera).digest() for camera in self._meta.video_keys}
        names = [name for name in self._meta.info["features"] if is_content(name)]
        logs = {
            name: self.column(name) for name in names if name not in self._meta.video_keys.values()
        }
        return demo_id(videos, {name: log for name, log in logs.items() if _is_numeric(log)})

    @cached_property
    def record(self) -> GroundTruth | None:
        """What is known about the demonstration; None when it carries no ground truth."""
        known = self._labels
        if any(known.get(name) is None for name in ("sequence", "correct", "mistakes")):
            return None
        try:
            return GroundTruth(
                sequence=str(known["sequence"]),
                correct=bool(known["correct"]),
                mistakes=tuple(_mistake(mistake) for mistake in known["mistakes"]),
                participant=self.participant,
                embodiment=self.embodiment,
                seed=known.get("seed"),
            )
        except (KeyError, TypeError) as error:
            raise PoolError(
                f"The ground truth of demonstration {self.index} is not readable."
            ) from error

    @property
    def participant(self) -> str | None:
        """Who demonstrated it; None when that was not logged."""
        return self._labels.get("participant")

    @property
    def embodiment(self) -> str | None:
        """Whose body did it (yumi, person); None when that was not logged."""
        return self._labels.get("embodiment")

    @cached_property
    def _labels(self) -> Mapping[str, Any]:
        """The teasim/* columns, or the manifest's entry where a tool has dropped the columns."""
        columns = {
            name.removeprefix("teasim/"): value
            for name, value in self.row.items()
            if name.startswith("teasim/")
        }
        entries = self._meta.manifest.get("episodes", ())
        if columns or not entries:
            return columns
        by_id = {entry.get("demo_id"): entry for entry in entries}
        entry: Mapping[str, Any] = by_id.get(self.demo_id, {})
        return entry

    def spans(self) -> tuple[Span, ...]:
        """Labelled sub-task spans in order of time; empty when the data set has no such labels.

        The spans logged beside the demonstration come first, because two spans of the same
        sub-task in a row look like one in `subtask_index`.

        Raises:
            PoolError: The labels are damaged or name no known sub-task.
        """
        names = self.row.get("sparse_subtask_names")
        if names is not None:
            starts = self.row.get("sparse_subtask_start_frames") or ()
            stops = self.row.get("sparse_subtask_end_frames") or ()
            try:
                return tuple(
                    Span(str(name), int(start), int(stop))
                    for name, start, stop in zip(names, starts, stops, strict=True)
                )
            except (TypeError, ValueError) as error:
                raise PoolError(
                    f"The sub-task spans of demonstration {self.index} are not readable."
                ) from error
        if layout.SUBTASK_INDEX not in self._meta.info["features"] or not self._meta.subtasks:
            return ()
        return spans_from_index(self.column(layout.SUBTASK_INDEX), self._meta.subtasks)

    def predicted_spans(self) -> tuple[Span, ...]:
        """Return nothing: a pool stores no predictions."""
        return ()

    def posteriors(self) -> None:
        """Return nothing: a pool stores no predictions."""

    @property
    def data_path(self) -> Path:
        """The parquet file that holds the demonstration's log."""
        return self._meta.data_path(self.row)

    def column(self, name: str) -> np.ndarray:
        """A per-frame column, e.g. observation.state.

        Returns:
            (n,) for scalars, (n, D) for vectors.

        Raises:
            PoolError: There is no such column, the file is missing or damaged, or the log is
                shorter than the demonstration.
        """
        column = read_column(self.data_path, name)
        part = column.slice(self._first_row, self.length)
        if len(part) < self.length:
            raise PoolError(
                f"The log '{self.data_path}' ends after {len(part)} of the {self.length} frames "
                f"of demonstration {self.index}."
            )
        return as_numpy(part, name)

    def clip(self, camera: str) -> VideoClip:
        """The demonstration's frames by `camera` (short name).

        Raises:
            PoolError: The pool has no such camera.
        """
        if camera not in self._meta.video_keys:
            choices = ", ".join(self._meta.video_keys) or "none"
            raise PoolError(f"The pool has no camera '{camera}'; it has {choices}.")
        key = self._meta.video_keys[camera]
        start = float(self.row[f"videos/{key}/from_timestamp"])
        path = self._meta.video_path(self.row, key)
        return VideoClip(path, start, self.length, float(self._meta.fps))


class Pool:
    """A pool of demonstrations on disk; never modified."""

    def __init__(self, meta: Metadata, episodes: tuple[Episode, ...]) -> None:
        """Use `Pool.open`."""
        self._meta = meta
        self.episodes = episodes

    @classmethod
    def open(cls, path: Path | str) -> Self:
        """Open a LeRobotDataset v3.0 folder; logs and videos are not read yet.

        Raises:
            PoolError: There is no pool at `path`, it is empty, or its metadata are damaged.
        """
        meta, rows = read_metadata(Path(path))
        starts = _first_rows(meta, rows)
        episodes = (Episode(meta, row, start) for row, start in zip(rows, starts, strict=True))
        return cls(meta, tuple(episodes))

    def __repr__(self) -> str:
        """Folder and size."""
        return f"Pool('{self.root}', {len(self.episodes)} demonstrations)"

    @property
    def root(self) -> Path:
        """Folder of the pool."""
        return self._meta.root

    @property
    def fps(self) -> int | float:
        """Frames per second of videos and logs."""
        return self._meta.fps

    @property
    def info(self) -> Mapping[str, Any]:
        """meta/info.json as it is."""
        return self._meta.info

    @property
    def manifest(self) -> Mapping[str, Any]:
        """teasim/manifest.json as it is; empty for a foreign data set."""
        return self._meta.manifest

    @property
    def cameras(self) -> tuple[str, ...]:
        """Short camera names: the key after 'observation.images.'."""
        return tuple(self._meta.video_keys)

    @property
    def subtasks(self) -> tuple[str, ...]:
        """Names in the order of subtask_index; empty when the data set labels none."""
        return self._meta.subtasks

    @property
    def state_names(self) -> tuple[str, ...] | None:
        """Names of the dimensions of observation.state; None without a joint log."""
        feature = self._meta.info["features"].get(layout.STATE)
        if feature is None:
            return None
        names = feature.get("names")
        if isinstance(names, Mapping):  # some recorders write {"motors": [...]}
            names = next(iter(names.values()), None)
        width = int(feature["shape"][0])
        return tuple(map(str, names)) if names else tuple(f"state_{i}" for i in range(width))

    def entries(self, indexes: Sequence[int]) -> list[str]:
        """Return the episode indexes as text."""
        return [str(index) for index in indexes]

    def usage(self, indexes: Sequence[int], *, keep: bool) -> list[str]:
        """Return lines for LeRobot, robomimic and Minari."""
        return lerobot_usage(self.root, indexes, keep=keep)

    def content_hash(self) -> str:
        """Hash of all a filter sees: frames, logs, sub-task labels, fps and cameras.

        What says whether a demonstration is correct (sequence, correct, mistakes, success,
        reward) stays out, as do file names. It is computed from the files, not looked up.

        Raises:
            PoolError: A file is missing or damaged.
        """
        content = hashlib.sha256()
        described = [float(self.fps), self.cameras, self.subtasks]
        content.update(json.dumps(described).encode())
        for episode in self.episodes:
            spans = [(span.subtask, span.start, span.stop) for span in episode.spans()]
            labelled = [episode.index, episode.length, episode.content_id(), spans]
            content.update(json.dumps(labelled).encode())
        return content.hexdigest()


def _first_rows(meta: Metadata, rows: Sequence[Row]) -> list[int]:
    """Row of its data file at which each demonstration starts."""
    file_starts: dict[Path, int] = {}
    for row in rows:
        path, start = meta.data_path(row), int(row["dataset_from_index"])
        file_starts[path] = min(start, file_starts.get(path, start))
    return [int(row["dataset_from_index"]) - file_starts[meta.data_path(row)] for row in rows]


def _mistake(stored: Mapping[str, Any]) -> MistakeSpan:
    start = stored["start_frame"] if "start_frame" in stored else stored["start"]
    stop = stored["end_frame"] if "end_frame" in stored else stored["stop"]
    return MistakeSpan(stored["name"], stored["subtask"], int(start), int(stop))


def _is_numeric(values: np.ndarray) -> bool:
    return np.issubdtype(values.dtype, np.number) or values.dtype == np.bool_
