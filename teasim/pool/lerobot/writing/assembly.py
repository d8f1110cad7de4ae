"""The files of a LeRobotDataset v3.0, assembled from demonstrations that are finished."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from teasim.common.files import link_or_copy, sha256_of, write_atomically, write_json
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import as_numpy, write_table
from teasim.pool.lerobot.writing.statistics import (
    ImageHistogram,
    Stats,
    column_stats,
    flatten,
    pool_histograms,
)
from teasim.pool.types import NO_SUBTASK, GroundTruth, MistakeSpan, Span

MISTAKES_TYPE = pa.list_(
    pa.struct(
        [
            ("name", pa.string()),
            ("subtask", pa.string()),
            ("start_frame", pa.int64()),
            ("end_frame", pa.int64()),
        ]
    )
)
TYPES = {
    "teasim/sequence": pa.string(),
    "teasim/correct": pa.bool_(),
    "teasim/mistakes": MISTAKES_TYPE,
    "teasim/participant": pa.string(),
    "teasim/embodiment": pa.string(),
    "teasim/seed": pa.int64(),
    "sparse_subtask_names": pa.list_(pa.string()),
    **{
        f"sparse_subtask_{edge}_{kind}": pa.list_(of)
        for kind, of in (("times", pa.float64()), ("frames", pa.int64()))
        for edge in ("start", "end")
    },
}
"""Types of columns of the episodes table in which all values may be missing."""


@dataclass(frozen=True)
class Part:
    """One demonstration that goes into a data set."""

    folder: Path
    """Holds one mp4 per camera, CAMERA.mp4."""
    columns: pa.Table
    """Per-frame columns but for those that need the other demonstrations (index, ...)."""
    histograms: Mapping[str, ImageHistogram]
    """Image histogram per camera."""
    task: str
    """The task as a sentence."""
    spans: tuple[Span, ...]
    """Sub-task spans in order of time."""
    facts: Mapping[str, Any]
    """Columns of its own in the episodes table, e.g. teasim/demo_id."""

    @property
    def length(self) -> int:
        """Number of frames."""
        n_rows: int = self.columns.num_rows
        return n_rows


@dataclass(frozen=True)
class Outline:
    """What all demonstrations of a data set have in common."""

    fps: int
    """Frames per second."""
    cameras: tuple[str, ...]
    """Short camera names."""
    features: Mapping[str, Any]
    """The features of info.json."""
    subtasks: tuple[str, ...]
    """Names of the sub-tasks in the order of `subtask_index`."""
    robot_type: str | None = None
    """LeRobot's robot type; None where it is not known."""
    labelled: bool = True
    """Whether sub-tasks are labelled; without labels their columns and files are absent."""
    manifest: Mapping[str, Any] = field(default_factory=dict)
    """The manifest but for the check sums."""


def truth_columns(record: GroundTruth | None) -> dict[str, Any]:
    """Return what is known about a demonstration as columns of the episodes table."""
    names = ("sequence", "correct", "mistakes", "participant", "embodiment", "seed")
    known = {name: getattr(record, name, None) for name in names}
    if record is not None:
        known["mistakes"] = [mistake_row(mistake) for mistake in record.mistakes]
    return {f"teasim/{name}": value for name, value in known.items()}


def mistake_row(mistake: MistakeSpan) -> dict[str, Any]:
    """Return a mistake as the episodes table holds it."""
    names = ("name", "subtask", "start_frame", "end_frame")
    return dict(zip(names, vars(mistake).values(), strict=True))


class Assembly:
    """All files of a data set, built from its demonstrations."""

    def __init__(self, root: Path, outline: Outline, parts: Sequence[Part]) -> None:
        """Number the demonstrations in the order of `parts`."""
        self.root = root
        self.outline = outline
        self.parts = parts
        self.tasks = list(dict.fromkeys(part.task for part in parts))
        self.starts = np.cumsum([0, *(part.length for part in parts)]).tolist()
        self.tables = [self._data_table(i) for i in range(len(parts))]

    def write(self) -> None:
        """Write everything below the root, info.json last."""
        for index, part in enumerate(self.parts):
            write_parquet(self.root / layout.data_path(index), self.tables[index])
            for camera in self.outline.cameras:
                target = self.root / layout.video_path(camera, index)
                link_or_copy(part.folder / f"{camera}.mp4", target)
        write_parquet(self.root / layout.TASKS, _named_index(self.tasks, "task"))
        write_parquet(self.root / layout.EPISODES, self._episodes_table())
        write_json(self.root / layout.STATS, self._pool_stats())
        if self.outline.labelled:
            subtasks = [*self.outline.subtasks, layout.NO_SUBTASK_NAME]
            numbers = [*range(len(subtasks) - 1), NO_SUBTASK]
            write_parquet(self.root / layout.SUBTASKS, _named_index(subtasks, "subtask", numbers))
            write_json(self.root / layout.TEMPORAL_PROPORTIONS, self._temporal_proportions())
        write_json(self.root / layout.MANIFEST, self.manifest())
        write_json(self.root / layout.INFO, self.info())

    def _data_table(self, index: int) -> pa.Table:
        part = self.parts[index]
        start, length = self.starts[index], part.length
        constants = {
            "episode_index": np.full(length, index, dtype=np.int64),
            "index": np.arange(start, start + length, dtype=np.int64),
            "task_index": np.full(length, self.tasks.index(part.task), dtype=np.int64),
        }
        table = part.columns
        for name, values in constants.items():
            table = table.append_column(name, pa.array(values))
        names = [name for name in self.outline.features if name in table.column_names]
        return table.select(names)

    def episode_stats(self, index: int) -> dict[str, Stats]:
        """Return the statistics of each feature of a demonstration."""
        table, histograms = self.tables[index], self.parts[index].histograms
        stats = {name: column_stats(as_numpy(table[name])) for name in self._numeric(table)}
        for camera, histogram in histograms.items():
            stats[layout.CAMERA_PREFIX + camera] = histogram.stats()
        return stats

    def _pool_stats(self) -> dict[str, Stats]:
        whole = pa.concat_tables(self.tables)
        stats = {name: column_stats(as_numpy(whole[name])) for name in self._numeric(whole)}
        for camera in self.outline.cameras:
            histograms = [part.histograms[camera] for part in self.parts]
            stats[layout.CAMERA_PREFIX + camera] = pool_histograms(histograms).stats()
        return stats

    @staticmethod
    def _numeric(table: pa.Table) -> list[str]:
        return [name for name in table.column_names if name != layout.LANGUAGE]

    def _episodes_table(self) -> pa.Table:
        rows = [self._episode_row(i) for i in range(len(self.parts))]
        columns = {name: [row[name] for row in rows] for name in rows[0]}
        return pa.table(
            {name: pa.array(values, type=TYPES.get(name)) for name, values in columns.items()}
        )

    def _episode_row(self, index: int) -> dict[str, Any]:
        part = self.parts[index]
        chunk, file = layout.place_of(index)
        row: dict[str, Any] = {
            "episode_index": index,
            "tasks": [part.task],
            "length": part.length,
            "data/chunk_index": chunk,
            "data/file_index": file,
            "dataset_from_index": self.starts[index],
            "dataset_to_index": self.starts[index + 1],
        }
        for camera in self.outline.cameras:
            key = f"videos/{layout.CAMERA_PREFIX}{camera}"
            row[f"{key}/chunk_index"] = chunk
            row[f"{key}/file_index"] = file
            row[f"{key}/from_timestamp"] = 0.0
            row[f"{key}/to_timestamp"] = part.length / self.outline.fps
        row |= part.facts
        row |= self.span_columns(index)
        row |= flatten(self.episode_stats(index))
        return row | {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}

    def span_columns(self, index: int) -> dict[str, list[Any]]:
        """Return SARM's columns of sub-task spans; none where sub-tasks are not labelled."""
        spans, fps = self.parts[index].spans, self.outline.fps
        if not self.outline.labelled:
            return {}
        return {
            "sparse_subtask_names": [span.subtask for span in spans],
            "sparse_subtask_start_times": [span.start / fps for span in spans],
            "sparse_subtask_end_times": [span.stop / fps for span in spans],
            "sparse_subtask_start_frames": [span.start for span in spans],
            "sparse_subtask_end_frames": [span.stop for span in spans],
        }

    def _temporal_proportions(self) -> dict[str, float]:
        """Mean share of each sub-task in the frames that belong to any (SARM)."""
        shares = []
        for part in self.parts:
            frames = dict.fromkeys(self.outline.subtasks, 0)
            for span in part.spans:
                frames[span.subtask] += span.stop - span.start
            total = max(sum(frames.values()), 1)
            shares.append([count / total for count in frames.values()])
        means = np.mean(shares, axis=0)
        return dict(zip(self.outline.subtasks, means.tolist(), strict=True))

    def manifest(self) -> dict[str, Any]:
        """The per-demonstration facts again, and a check sum for every data and video file."""
        found = (p for part in ("data", "videos") for p in (self.root / part).rglob("*"))
        paths = sorted(p for p in found if p.is_file())
        sums = {p.relative_to(self.root).as_posix(): sha256_of(p) for p in paths}
        return {**self.outline.manifest, "sha256": sums}

    def info(self) -> dict[str, Any]:
        """The content of info.json."""
        return {
            "codebase_version": layout.CODEBASE_VERSION,
            "robot_type": self.outline.robot_type,
            "total_episodes": len(self.parts),
            "total_frames": self.starts[-1],
            "total_tasks": len(self.tasks),
            "chunks_size": layout.CHUNK_SIZE,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": self.outline.fps,
            "splits": {"train": f"0:{len(self.parts)}"},
            "data_path": layout.DATA_PATH,
            "video_path": layout.VIDEO_PATH if self.outline.cameras else None,
            "features": dict(self.outline.features),
        }


def _named_index(names: Sequence[str], what: str, indices: Sequence[int] | None = None) -> pa.Table:
    """A pandas frame with the names as its index and one column `{what}_index`."""
    column = f"{what}_index"
    numbers = range(len(names)) if indices is None else indices
    table = pa.table({column: pa.array(numbers, pa.int64()), what: pa.array(names, pa.string())})

    def described(name: str, kind: str, numpy_kind: str) -> dict[str, Any]:
        return {
            "name": name,
            "field_name": name,
            "pandas_type": kind,
            "numpy_type": numpy_kind,
            "metadata": None,
        }

    pandas = {
        "index_columns": [what],
        "column_indexes": [described("", "unicode", "object") | {"name": None}],
        "columns": [described(column, "int64", "int64"), described(what, "unicode", "object")],
        "pandas_version": "2.0.0",
    }
    return table.replace_schema_metadata({"pandas": json.dumps(pandas)})


def write_parquet(path: Path, table: pa.Table) -> None:
    """Write a parquet file atomically."""
    write_atomically(path, lambda target: write_table(target, table))
