"""Turning finished demonstrations into a pool: numbers, statistics and metadata, then a rename."""

import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from teasim.common.errors import PoolError
from teasim.common.files import link_or_copy, sha256_of, sync, write_atomically, write_json
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import as_numpy, write_table
from teasim.pool.lerobot.reader import Pool
from teasim.pool.lerobot.writing.staging import (
    StagedEpisode,
    claim_folder,
    load_staged,
    record_as_json,
    staged_folder,
)
from teasim.pool.lerobot.writing.statistics import (
    Stats,
    column_stats,
    flatten,
    pool_histograms,
)
from teasim.pool.types import NO_SUBTASK, PoolHeader

MANIFEST_FORMAT = "teasim-pool"
MANIFEST_VERSION = 1
"""Version of the form of the manifest."""
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


def finalize_pool(root: Path | str, header: PoolHeader, n_episodes: int) -> Pool:
    """Make one LeRobotDataset of the demonstrations 0 to `n_episodes` - 1.

    Everything is assembled beside the staged demonstrations and renamed into place, `meta` last;
    a crash at any point can be repaired by calling this again. Files depend on the content alone,
    not on who wrote it in which order.

    Raises:
        PoolError: A demonstration is not finished, or `root` belongs to something else.
    """
    root = Path(root)
    claim_folder(root, header)
    missing = [i for i in range(n_episodes) if not staged_folder(root, i).is_dir()]
    if missing or not n_episodes:
        which = ", ".join(str(i) for i in missing[:10]) or "all"
        raise PoolError(
            f"The pool '{root}' cannot be finished: {len(missing)} of its {n_episodes} "
            f"demonstrations are missing ({which})."
        )
    staged = [load_staged(staged_folder(root, i)) for i in range(n_episodes)]
    assembled = root / layout.STAGING / "pool"
    shutil.rmtree(assembled, ignore_errors=True)
    _Assembly(assembled, header, staged).write()
    for folder in ("data", "videos", "teasim", "meta"):
        shutil.rmtree(root / folder, ignore_errors=True)
        (assembled / folder).rename(root / folder)
    sync(root)
    shutil.rmtree(root / layout.STAGING)
    return Pool.open(root)


class _Assembly:
    """All files of a pool, built from its staged demonstrations."""

    def __init__(self, root: Path, header: PoolHeader, episodes: Sequence[StagedEpisode]) -> None:
        self.root = root
        self.header = header
        self.episodes = episodes
        self.features = layout.features_of(header)
        self.tasks = list(dict.fromkeys(episode.record.task for episode in episodes))
        self.starts = np.cumsum([0, *(episode.length for episode in episodes)]).tolist()
        self.tables = [self._data_table(i) for i in range(len(episodes))]

    def write(self) -> None:
        for index, episode in enumerate(self.episodes):
            _write_parquet(self.root / layout.data_path(index), self.tables[index])
            for camera in self.header.cameras:
                target = self.root / layout.video_path(camera, index)
                link_or_copy(episode.folder / f"{camera}.mp4", target)
        _write_parquet(self.root / layout.TASKS, _named_index(self.tasks, "task"))
        subtasks = [*self.header.subtasks, layout.NO_SUBTASK_NAME]
        _write_parquet(
            self.root / layout.SUBTASKS,
            _named_index(subtasks, "subtask", [*range(len(subtasks) - 1), NO_SUBTASK]),
        )
        _write_parquet(self.root / layout.EPISODES, self._episodes_table())
        write_json(self.root / layout.STATS, self._pool_stats())
        write_json(self.root / layout.TEMPORAL_PROPORTIONS, self._temporal_proportions())
        write_json(self.root / layout.MANIFEST, self._manifest())
        write_json(self.root / layout.INFO, self._info())

    def _data_table(self, index: int) -> pa.Table:
        episode = self.episodes[index]
        start, length = self.starts[index], episode.length
        constants = {
            "episode_index": np.full(length, index, dtype=np.int64),
            "index": np.arange(start, start + length, dtype=np.int64),
            "task_index": np.full(length, self.tasks.index(episode.record.task), dtype=np.int64),
        }
        table = episode.columns
        for name, values in constants.items():
            table = table.append_column(name, pa.array(values))
        return table.select([name for name in self.features if name in table.column_names])

    def _episode_stats(self, index: int) -> dict[str, Stats]:
        stats = {
            name: column_stats(as_numpy(column))
            for name, column in zip(
                self.tables[index].column_names, self.tables[index].columns, strict=True
            )
        }
        for camera, histogram in self.episodes[index].histograms.items():
            stats[layout.CAMERA_PREFIX + camera] = histogram.stats()
        return stats

    def _pool_stats(self) -> dict[str, Stats]:
        whole = pa.concat_tables(self.tables)
        stats = {name: column_stats(as_numpy(whole[name])) for name in whole.column_names}
        for camera in self.header.cameras:
            histograms = [episode.histograms[camera] for episode in self.episodes]
            stats[layout.CAMERA_PREFIX + camera] = pool_histograms(histograms).stats()
        return stats

    def _episodes_table(self) -> pa.Table:
        rows = [self._episode_row(i) for i in range(len(self.episodes))]
        columns = {name: [row[name] for row in rows] for name in rows[0]}
        types = {"teasim/mistakes": MISTAKES_TYPE, "sparse_subtask_names": pa.list_(pa.string())}
        for kind, of in (("times", pa.float64()), ("frames", pa.int64())):
            for edge in ("start", "end"):
                types[f"sparse_subtask_{edge}_{kind}"] = pa.list_(of)
        return pa.table(
            {name: pa.array(values, type=types.get(name)) for name, values in columns.items()}
        )

    def _episode_row(self, index: int) -> dict[str, Any]:
        episode = self.episodes[index]
        record, fps = episode.record, self.header.fps
        chunk, file = layout.place_of(index)
        row: dict[str, Any] = {
            "episode_index": index,
            "tasks": [record.task],
            "length": episode.length,
            "data/chunk_index": chunk,
            "data/file_index": file,
            "dataset_from_index": self.starts[index],
            "dataset_to_index": self.starts[index + 1],
        }
        for camera in self.header.cameras:
            key = f"videos/{layout.CAMERA_PREFIX}{camera}"
            row[f"{key}/chunk_index"] = chunk
            row[f"{key}/file_index"] = file
            row[f"{key}/from_timestamp"] = 0.0
            row[f"{key}/to_timestamp"] = episode.length / fps
        row |= {
            "teasim/demo_id": episode.demo_id,
            "teasim/sequence": record.sequence,
            "teasim/correct": record.correct,
            "teasim/mistakes": [
                dict(zip(("name", "subtask", "start_frame", "end_frame"), values, strict=True))
                for values in (tuple(vars(mistake).values()) for mistake in record.mistakes)
            ],
            "teasim/participant": record.participant,
            "teasim/embodiment": record.embodiment,
            "teasim/seed": record.seed,
            "sparse_subtask_names": [span.subtask for span in record.spans],
            "sparse_subtask_start_times": [span.start / fps for span in record.spans],
            "sparse_subtask_end_times": [span.stop / fps for span in record.spans],
            "sparse_subtask_start_frames": [span.start for span in record.spans],
            "sparse_subtask_end_frames": [span.stop for span in record.spans],
        }
        row |= flatten(self._episode_stats(index))
        return row | {"meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0}

    def _temporal_proportions(self) -> dict[str, float]:
        """Mean share of each sub-task in the frames that belong to any (SARM)."""
        shares = []
        for episode in self.episodes:
            frames = dict.fromkeys(self.header.subtasks, 0)
            for span in episode.record.spans:
                frames[span.subtask] += span.stop - span.start
            total = max(sum(frames.values()), 1)
            shares.append([count / total for count in frames.values()])
        means = np.mean(shares, axis=0)
        return dict(zip(self.header.subtasks, means.tolist(), strict=True))

    def _manifest(self) -> dict[str, Any]:
        """The per-demonstration facts again, and a check sum for every data and video file."""
        found = (p for part in ("data", "videos") for p in (self.root / part).rglob("*"))
        paths = sorted(p for p in found if p.is_file())
        return {
            "format": MANIFEST_FORMAT,
            "version": MANIFEST_VERSION,
            **self.header.as_json(),
            "features": sorted(self.features),
            "episodes": [
                {"episode_index": i, "demo_id": e.demo_id} | record_as_json(e.record)
                for i, e in enumerate(self.episodes)
            ],
            "sha256": {p.relative_to(self.root).as_posix(): sha256_of(p) for p in paths},
        }

    def _info(self) -> dict[str, Any]:
        return {
            "codebase_version": layout.CODEBASE_VERSION,
            "robot_type": self.header.robot_type,
            "total_episodes": len(self.episodes),
            "total_frames": self.starts[-1],
            "total_tasks": len(self.tasks),
            "chunks_size": layout.CHUNK_SIZE,
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "fps": self.header.fps,
            "splits": {"train": f"0:{len(self.episodes)}"},
            "data_path": layout.DATA_PATH,
            "video_path": layout.VIDEO_PATH,
            "features": self.features,
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


def _write_parquet(path: Path, table: pa.Table) -> None:
    write_atomically(path, lambda target: write_table(target, table))
