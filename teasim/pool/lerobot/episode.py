"""One demonstration of a LeRobot data set; its logs and frames are read when asked for."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
import pyarrow as pa

from teasim.common.errors import PoolError
from teasim.pool.clips import VideoClip
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import as_numpy, numbers, read_column, whole_numbers
from teasim.pool.lerobot.describing.features import NOT_NUMBERS, is_log
from teasim.pool.lerobot.describing.metadata import Metadata
from teasim.pool.lerobot.identity import demo_id, halves, identifying_log
from teasim.pool.lerobot.images import image_clip
from teasim.pool.lerobot.labelling import Labelling
from teasim.pool.lerobot.labels import annotated_spans, said, said_spans
from teasim.pool.lerobot.log import Rows, rows_of
from teasim.pool.source import Clip
from teasim.pool.types import NO_SUBTASK, GroundTruth, MistakeSpan, Span, spans_from_index


class Episode:
    """One demonstration; its logs and frames are read when asked for."""

    def __init__(self, meta: Metadata, labelling: Labelling, place: int) -> None:
        """Describe the demonstration at `place` of the episodes table."""
        self._meta = meta
        self._labelling = labelling
        self._place = place

    def __repr__(self) -> str:
        """Number and length."""
        return f"Episode(index={self.index}, length={self.length})"

    def __reduce__(self) -> tuple[type[Self], tuple[Metadata, Labelling, int]]:
        """Travel to a worker process without the other demonstrations of the table."""
        meta = replace(self._meta, episodes=self._meta.episodes.only(self._place))
        return type(self), (meta, self._labelling.told_to(meta), 0)

    @cached_property
    def row(self) -> Mapping[str, Any]:
        """The demonstration's row of the episodes table, without its statistics."""
        return self._meta.episodes.row(self._place)

    @property
    def index(self) -> int:
        """Number of the demonstration in its pool."""
        return int(self._meta.episodes.numbers["episode_index"][self._place])

    @property
    def name(self) -> str:
        """What a person calls it."""
        return f"video {self.index}"

    @property
    def length(self) -> int:
        """Number of frames."""
        return int(self._meta.episodes.numbers["length"][self._place])

    @cached_property
    def task(self) -> str:
        """The task as a sentence; empty when the data set names none.

        A demonstration of several tasks has all of them, divided by '; '.

        Raises:
            PoolError: The episodes table names none, and the log or the list of tasks is damaged.
        """
        tasks = self.row.get("tasks")
        if isinstance(tasks, list) and tasks:
            return "; ".join(dict.fromkeys(map(str, tasks)))
        if isinstance(tasks, str) or "task_index" not in self._meta.features:
            return str(tasks or "")
        told = np.unique(whole_numbers(self._part("task_index"), "task_index")).tolist()
        return "; ".join(self._meta.tasks[number] for number in told if number in self._meta.tasks)

    @cached_property
    def demo_id(self) -> str:
        """Stable identity: the stored one, else computed from the content.

        Raises:
            PoolError: It must be computed and a file is missing or damaged.
        """
        told = self.row.get("teasim/demo_id")
        return told if isinstance(told, str) and told else self.content_id()

    def content_id(self) -> str:
        """Identity computed from the pictures and the logs on disk.

        Raises:
            PoolError: A file is missing or damaged, or ends too early.
        """
        cameras = self._meta.cameras
        first = min(cameras, key=cameras.__getitem__, default=None)
        pictures = {} if first is None else {cameras[first]: self.clip(first).digest()}
        features = self._meta.features
        numeric = {name: s for name, s in features.items() if s["dtype"] not in NOT_NUMBERS}
        name = identifying_log(numeric)
        if name is None:
            nothing = not pictures
            own = np.array([self.index, self.length])
            return demo_id(pictures, {layout.ACTION: own} if nothing else {})
        return demo_id(pictures, {name: _told_values(self._part(name), name)})

    def check_identity(self) -> Iterator[str]:
        """Yield a sentence if the content is not the one that the stored identity was made from.

        Raises:
            PoolError: A file is missing or damaged.
        """
        told = self.row.get("teasim/demo_id")
        known = set(halves(told)) if isinstance(told, str) else set()
        if known and not known & set(halves(self.content_id())):
            yield f"Demonstration {self.index} is not the one that was written as {told}."

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
        except (KeyError, TypeError, ValueError) as error:
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
        by_id = {str(entry.get("demo_id")): entry for entry in entries}
        entry: Mapping[str, Any] = by_id.get(self.demo_id, {})
        return entry

    def spans(self) -> tuple[Span, ...]:
        """Labelled sub-task spans in order of time; empty when the data set has no such labels.

        The spans logged beside the demonstration come first, because two spans of the same
        sub-task in a row look like one in `subtask_index`.

        Raises:
            PoolError: The labels are damaged or name no known sub-task.
        """
        kind = self._labelling.kind
        if kind is not None and self.row.get(f"{kind}_subtask_names") is not None:
            return annotated_spans(self.row, kind, self.length)
        if self._labelling.is_said:
            rows = self._rows()
            return said_spans(said(self._part(layout.LANGUAGE)), rows, float(self._meta.fps))
        if not self._labelling.is_numbered:
            return ()
        return spans_from_index(self.column(layout.SUBTASK_INDEX), self._labelling.names)

    def check_labels(self) -> Iterator[str]:
        """Yield a sentence for each label that is damaged.

        Raises:
            PoolError: The labels are not readable.
        """
        self.spans()
        record, listed = self.record, self._labelling.listed
        if record is not None and any(m.stop > self.length for m in record.mistakes):
            yield f"A mistake lies outside demonstration {self.index}."
        if not listed or not self._labelling.is_numbered:
            return
        index = whole_numbers(self._part(layout.SUBTASK_INDEX), layout.SUBTASK_INDEX)
        if ((index < NO_SUBTASK) | (index >= len(listed))).any():
            yield (
                f"There is a sub-task number without a name in the log '{self.data_path}' of "
                f"demonstration {self.index}."
            )

    def predicted_spans(self) -> tuple[Span, ...]:
        """Return nothing: a pool stores no predictions."""
        return ()

    def posteriors(self) -> None:
        """Return nothing: a pool stores no predictions."""

    @property
    def data_path(self) -> Path:
        """The parquet file that holds the demonstration's log."""
        return self._meta.data_path(self.row)

    def video_files(self) -> dict[str, Path]:
        """Return the video of each feature, depth cameras included, by its key.

        Raises:
            PoolError: A path leads out of the data set.
        """
        kinds = self._meta.features.items()
        keys = [key for key, spec in kinds if spec["dtype"] == "video"]
        return {key: self._meta.video_path(self.row, key) for key in keys}

    def column(self, name: str) -> np.ndarray:
        """A per-frame column, e.g. observation.state.

        Returns:
            (n,) for scalars, (n, D) for vectors.

        Raises:
            PoolError: There is no such column, the file is missing or damaged, a value is missing
                or not finite, or the log is not as long as the demonstration.
        """
        part = self._part(name)
        values = numbers(part, name) if name in layout.SCALARS else as_numpy(part, name)
        if values.dtype.kind == "f" and not np.isfinite(values).all():
            frame = int(np.argwhere(~np.isfinite(values))[0][0])
            raise PoolError(
                f"'{name}' is not a finite number at frame {frame} in the log "
                f"'{self.data_path}' of demonstration {self.index}."
            )
        return values

    def log(self, name: str) -> np.ndarray:
        """A log of numbers, (n, D) float32.

        Raises:
            PoolError: There is no such log, or it is damaged (see `column`).
        """
        features = self._meta.features
        if name not in features or not is_log(name, features[name]):
            known = ", ".join(key for key, spec in features.items() if is_log(key, spec)) or "none"
            raise PoolError(f"'{self.name}' has no log '{name}'; it has {known}.")
        return self.column(name).reshape(self.length, -1).astype(np.float32)

    def clip(self, camera: str) -> Clip:
        """The demonstration's frames by `camera` (short name).

        Raises:
            PoolError: The pool has no such camera, or the log of the frames is damaged.
        """
        if camera not in self._meta.cameras:
            choices = ", ".join(self._meta.cameras) or "none"
            raise PoolError(f"The pool has no camera '{camera}'; it has {choices}.")
        key, rows = self._meta.cameras[camera], self._rows()
        if key not in self._meta.videos:
            return image_clip(rows, key)
        fps = float(self._meta.fps)
        begin = float(self.row.get(f"videos/{key}/from_timestamp", 0.0))
        path = self._meta.video_path(self.row, key)
        return VideoClip(path, begin, self.length, fps, rows.times(fps))

    def has_video(self, camera: str) -> bool:
        """Whether the pictures of a camera are in a video file, not in the log."""
        return self._meta.cameras.get(camera) in self._meta.videos

    def log_rows(self) -> Rows:
        """Return the demonstration's rows of its data file, however many there are.

        Raises:
            PoolError: The file is missing or damaged.
        """
        return rows_of(self.data_path, self.index)

    def _rows(self) -> Rows:
        rows = self.log_rows()
        if len(rows) != self.length:
            raise PoolError(
                f"The log '{rows.path}' has {len(rows)} rows of demonstration {self.index}, "
                f"which has {self.length} frames."
            )
        return rows

    def _part(self, name: str) -> pa.ChunkedArray:
        return self._rows().select(read_column(self.data_path, name))


def _mistake(stored: Mapping[str, Any]) -> MistakeSpan:
    start = stored["start_frame"] if "start_frame" in stored else stored["start"]
    stop = stored["end_frame"] if "end_frame" in stored else stored["stop"]
    return MistakeSpan(stored["name"], stored["subtask"], int(start), int(stop))


def _told_values(part: pa.ChunkedArray, name: str) -> np.ndarray:
    """The values of a column that are there; of one that holds no numbers, their text."""
    try:
        values = as_numpy(part.drop_null(), name)
    except PoolError:
        values = np.empty(0, dtype=object)
    if values.dtype.kind in "iufb" and values.size:
        return values
    return np.frombuffer(str(part.to_pylist()).encode(), dtype=np.uint8)
