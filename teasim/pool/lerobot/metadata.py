"""What a pool says about itself: info.json, the manifest, and the episodes table, checked."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from teasim.common.errors import PoolError
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import read_table

Row = Mapping[str, Any]
"""A demonstration's row of the episodes table, without its statistics."""

EPISODE_COLUMNS = (
    "episode_index",
    "length",
    "data/chunk_index",
    "data/file_index",
    "dataset_from_index",
    "dataset_to_index",
)


@dataclass(frozen=True)
class Metadata:
    """What info.json and the manifest say about all demonstrations."""

    root: Path
    """Folder of the pool."""
    info: Mapping[str, Any]
    """meta/info.json."""
    manifest: Mapping[str, Any]
    """teasim/manifest.json; empty for a foreign data set."""
    subtasks: tuple[str, ...]
    """Names in the order of subtask_index; empty when unknown."""

    @property
    def fps(self) -> int | float:
        """Frames per second."""
        fps: int | float = self.info["fps"]
        return fps

    @cached_property
    def video_keys(self) -> dict[str, str]:
        """Feature key of each camera by its short name."""
        features = self.info["features"]
        keys = [key for key, spec in features.items() if spec["dtype"] == "video"]
        return {key.removeprefix(layout.CAMERA_PREFIX): key for key in keys}

    def data_path(self, row: Row) -> Path:
        """Data file of the demonstration described by `row` of the episodes table."""
        return self.root / _filled(
            self.info["data_path"],
            chunk_index=row["data/chunk_index"],
            file_index=row["data/file_index"],
        )

    def video_path(self, row: Row, key: str) -> Path:
        """The mp4 of video feature `key` of the demonstration described by `row`."""
        return self.root / _filled(
            self.info.get("video_path") or layout.VIDEO_PATH,
            video_key=key,
            chunk_index=row[f"videos/{key}/chunk_index"],
            file_index=row[f"videos/{key}/file_index"],
        )


def read_metadata(root: Path) -> tuple[Metadata, tuple[Row, ...]]:
    """Everything but logs and videos: what all demonstrations share, and a row for each.

    Raises:
        PoolError: There is no pool at `root`, it is empty, or its metadata are damaged.
    """
    require_pool_folder(root)
    info = _read_info(root)
    rows = _episode_rows(root, info)
    manifest = _read_manifest(root)
    return Metadata(root, info, manifest, _subtask_names(root, manifest, rows)), tuple(rows)


def require_pool_folder(root: Path) -> None:
    """Refuse a path that holds no pool at all.

    Raises:
        PoolError: `root` is missing, no folder, empty, unfinished, or has no meta/info.json.
    """
    if not root.exists():
        raise PoolError(f"There is no pool at '{root}': the folder does not exist.")
    if not root.is_dir():
        raise PoolError(f"There is no pool at '{root}': it is a file, and a pool is a folder.")
    if (root / layout.INFO).is_file():
        return
    if (root / layout.STAGING).is_dir():
        done = sum(p.name[-6:].isdigit() for p in (root / layout.STAGING).glob("episode-*"))
        raise PoolError(
            f"The pool '{root}' is unfinished, with {done} complete demonstrations; generate it "
            f"again with the same settings to finish it."
        )
    if not any(root.iterdir()):
        raise PoolError(f"There is no pool at '{root}': the folder is empty.")
    raise PoolError(
        f"There is no pool at '{root}': a LeRobot v3.0 data set has the file {layout.INFO}."
    )


def _read_info(root: Path) -> Mapping[str, Any]:
    """meta/info.json, checked for what the reader relies on."""
    path = root / layout.INFO
    info = _read_json(path)
    version = str(info.get("codebase_version"))
    if not version.startswith("v3."):
        raise PoolError(
            f"The data set '{root}' has LeRobot format {version}; only v3.0 can be read, so "
            f"convert it first."
        )
    fps = info.get("fps")
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 0 < fps < 1e6:
        raise PoolError(f"The file '{path}' is damaged: fps is {fps}, not a positive number.")
    features = info.get("features")
    if not isinstance(features, dict) or not all(_is_feature(spec) for spec in features.values()):
        raise PoolError(f"The file '{path}' is damaged: 'features' is not readable.")
    if not isinstance(info.get("data_path"), str):
        raise PoolError(f"The file '{path}' is damaged: it has no 'data_path'.")
    return info


def _is_feature(spec: Any) -> bool:
    if not isinstance(spec, dict) or not isinstance(spec.get("dtype"), str):
        return False
    shape = spec.get("shape")
    return isinstance(shape, list) and bool(shape) and all(isinstance(n, int) for n in shape)


def _read_manifest(root: Path) -> Mapping[str, Any]:
    path = root / layout.MANIFEST
    if not path.exists():
        return {}
    manifest = _read_json(path)
    entries = manifest.get("episodes", [])
    names = manifest.get("subtasks", [])
    sums = manifest.get("sha256", {})
    lists = isinstance(entries, list) and isinstance(names, list) and isinstance(sums, dict)
    if not lists or not all(isinstance(entry, dict) for entry in entries):
        raise PoolError(f"The file '{path}' is damaged: it does not have the form of a manifest.")
    return manifest


def _read_json(path: Path) -> dict[str, Any]:
    try:
        value = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise PoolError(f"The file '{path}' is damaged: it is no readable JSON.") from error
    if not isinstance(value, dict):
        raise PoolError(f"The file '{path}' is damaged: it is not a JSON object.")
    return value


def _read_subtasks(path: Path) -> tuple[str, ...]:
    """Names of subtasks.parquet in the order of their index; () when the file is absent."""
    if not path.exists():
        return ()
    numbered = []
    for row in read_table(path).to_pylist():
        number = row.pop(layout.SUBTASK_INDEX, None)
        name = next((value for value in row.values() if isinstance(value, str)), None)
        if not isinstance(number, int) or name is None:
            raise PoolError(f"The file '{path}' is damaged: it has no names with their numbers.")
        if number >= 0:
            numbered.append((number, name))
    return tuple(name for _, name in sorted(numbered))


def _subtask_names(root: Path, manifest: Mapping[str, Any], rows: Sequence[Row]) -> tuple[str, ...]:
    """From the manifest, else from subtasks.parquet, else from the spans beside the episodes."""
    logged = tuple(map(str, manifest.get("subtasks", ())))
    spans = (name for row in rows for name in row.get("sparse_subtask_names") or ())
    return logged or _read_subtasks(root / layout.SUBTASKS) or tuple(dict.fromkeys(spans))


def _episode_rows(root: Path, info: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The episodes table without its statistics, in order of the episode index."""
    files = sorted((root / layout.EPISODES_FOLDER).rglob("*.parquet"))
    rows = [
        row
        for file in files
        for row in read_table(file, wanted=lambda name: not name.startswith("stats/")).to_pylist()
    ]
    if not rows:
        raise PoolError(f"The pool '{root}' is empty: it has no demonstration.")
    keys = [key for key, spec in info["features"].items() if spec["dtype"] == "video"]
    for row in rows:
        _check_row(root, row, keys)
    return sorted(rows, key=lambda row: int(row["episode_index"]))


def _check_row(root: Path, row: Row, video_keys: Sequence[str]) -> None:
    whole = [*EPISODE_COLUMNS]
    for key in video_keys:
        whole += [f"videos/{key}/chunk_index", f"videos/{key}/file_index"]
        stamp = row.get(f"videos/{key}/from_timestamp")
        if not isinstance(stamp, int | float) or not 0 <= stamp < 1e9:
            raise PoolError(
                f"The episodes table of '{root}' is damaged: 'videos/{key}/from_timestamp' is "
                f"{stamp}."
            )
    for name in whole:
        value = row.get(name)
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise PoolError(f"The episodes table of '{root}' is damaged: '{name}' is {value}.")
    if row["length"] < 1:
        raise PoolError(f"The demonstration {row['episode_index']} of '{root}' has no frame.")


def _filled(template: str, **values: Any) -> str:
    try:
        return template.format(**values)
    except (KeyError, IndexError, ValueError, TypeError, AttributeError) as error:
        raise PoolError(f"The path '{template}' of info.json is not readable.") from error
