"""What a pool says about itself: info.json, the manifest, and the episodes table, checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from teasim.common.errors import PoolError
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.describing.cameras import camera_keys, depth_keys
from teasim.pool.lerobot.describing.documents import read_json, read_lines
from teasim.pool.lerobot.describing.episode_table import (
    EpisodeTable,
    Row,
    read_json_episodes,
    read_parquet_episodes,
)
from teasim.pool.lerobot.describing.names import names_by_number
from teasim.pool.lerobot.describing.places import filled, homes_of, inside

FASTEST = 1e6
"""No data set has more frames per second."""
CONVERT = "`teasim convert` writes one from other formats"
"""What helps who has another kind of data set."""


@dataclass(frozen=True)
class Metadata:
    """What info.json, the manifest and the episodes table say."""

    root: Path
    """Folder of the pool."""
    info: Mapping[str, Any]
    """meta/info.json."""
    manifest: Mapping[str, Any]
    """teasim/manifest.json; empty for a foreign data set."""
    episodes: EpisodeTable
    """The demonstrations."""

    @property
    def fps(self) -> int | float:
        """Frames per second."""
        fps: int | float = self.info["fps"]
        return fps

    @property
    def features(self) -> Mapping[str, Any]:
        """What is stored of each frame: kind and shape by key."""
        features: Mapping[str, Any] = self.info["features"]
        return features

    @property
    def has_lines(self) -> bool:
        """Whether the demonstrations are listed in JSON lines and have files of their own."""
        return _has_lines(self.info)

    @cached_property
    def cameras(self) -> dict[str, str]:
        """Feature key of each camera by its short name."""
        return camera_keys(self.features)

    @cached_property
    def videos(self) -> tuple[str, ...]:
        """Keys of the cameras whose pictures are in video files."""
        keys = self.cameras.values()
        return tuple(key for key in keys if self.features[key]["dtype"] == "video")

    @cached_property
    def tasks(self) -> Mapping[int, str]:
        """The tasks by their number, empty where there is no list of them.

        Raises:
            PoolError: The list is damaged.
        """
        if not (self.root / layout.TASKS_LINES).exists():
            return names_by_number(self.root / layout.TASKS, "task_index")
        lines = read_lines(self.root / layout.TASKS_LINES)
        return {
            line["task_index"]: str(line.get("task", ""))
            for line in lines
            if isinstance(line.get("task_index"), int)
        }

    @cached_property
    def homes(self) -> tuple[Path, ...]:
        """Folders its files may lie in.

        Raises:
            PoolError: A link leads to itself.
        """
        return homes_of(self.root)

    def data_path(self, row: Row) -> Path:
        """Return the data file of the demonstration described by `row`.

        Raises:
            PoolError: The path leads out of the data set.
        """
        place = {name: row[f"data/{name}"] for name in _PLACE if f"data/{name}" in row}
        return self._path(self.info["data_path"], row, place)

    def video_path(self, row: Row, key: str) -> Path:
        """Return the video of feature `key` of the demonstration described by `row`.

        Raises:
            PoolError: The path leads out of the data set.
        """
        names = [name for name in _PLACE if f"videos/{key}/{name}" in row]
        place = {name: row[f"videos/{key}/{name}"] for name in names}
        template = self.info.get("video_path") or layout.VIDEO_PATH
        return self._path(template, row, {"video_key": key, **place})

    def _path(self, template: str, row: Row, values: Mapping[str, int | str]) -> Path:
        index = int(row["episode_index"])
        chunk = index // self.info.get("chunks_size", layout.CHUNK_SIZE)
        numbers = {"episode_index": index, "episode_chunk": chunk}
        return inside(self.root, filled(template, {**numbers, **values}), self.homes)


_PLACE = ("chunk_index", "file_index")


def read_metadata(root: Path) -> Metadata:
    """Read everything but logs and videos.

    Raises:
        PoolError: There is no pool at `root`, it is empty, or its metadata are damaged.
    """
    require_pool_folder(root)
    info = _read_info(root)
    keys = [
        k for k in camera_keys(info["features"]).values() if info["features"][k]["dtype"] == "video"
    ]
    episodes = read_json_episodes(root) if _has_lines(info) else read_parquet_episodes(root, keys)
    meta = Metadata(root, info, _read_manifest(root), episodes)
    first = episodes.row(0)
    meta.data_path(first)  # a template that is no path is told when the pool is opened
    for key in keys:
        meta.video_path(first, key)
    return meta


def metadata_notes(meta: Metadata) -> list[str]:
    """Return what a reader of the metadata should know that harms no demonstration."""
    notes = [f"The depth camera '{key}' is left out." for key in depth_keys(meta.features)]
    counted = {
        "total_episodes": len(meta.episodes),
        "total_frames": int(meta.episodes.numbers["length"].sum()),
    }
    notes += [
        f"'{layout.INFO}' says {name} is {meta.info.get(name)} but the episodes table has {count}."
        for name, count in counted.items()
        if meta.info.get(name) != count
    ]
    index = meta.episodes.numbers["episode_index"]
    if index[-1] != len(index) - 1:
        notes.append(
            f"The demonstrations are not numbered 0 to {len(index) - 1} without a gap; LeRobot's "
            "own tools need that."
        )
    return notes


def require_pool_folder(root: Path) -> None:
    """Refuse a path that holds no pool at all.

    Raises:
        PoolError: `root` is missing, no folder, empty, unfinished, or has no meta/info.json.
    """
    if not root.exists():
        raise PoolError(f"There is no pool at '{root}': the folder does not exist.")
    if not root.is_dir():
        raise PoolError(
            f"There is no pool at '{root}': it is a file, and a pool is a folder; {CONVERT}."
        )
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
        f"There is no pool at '{root}': a LeRobot data set has the file {layout.INFO}; {CONVERT}."
    )


def _read_info(root: Path) -> Mapping[str, Any]:
    """meta/info.json, checked for what the reader relies on."""
    path = root / layout.INFO
    info = read_json(path)
    version = info.get("codebase_version")
    if not isinstance(version, str) or not version.startswith(("v2.", "v3.")):
        raise PoolError(
            f"The data set '{root}' has LeRobot format {version}; v2.0, v2.1 and v3.0 can be "
            "read, so convert it with LeRobot first."
        )
    fps = info.get("fps")
    if isinstance(fps, bool) or not isinstance(fps, int | float) or not 0 < fps < FASTEST:
        raise PoolError(f"The file '{path}' is damaged: fps is {fps}, not a positive number.")
    features = info.get("features")
    if not isinstance(features, dict) or not all(map(_is_feature, features.values())):
        raise PoolError(f"The file '{path}' is damaged: 'features' is not readable.")
    _check_paths(path, info)
    return info


def _has_lines(info: Mapping[str, Any]) -> bool:
    return str(info["codebase_version"]).startswith("v2.")


def _check_paths(path: Path, info: Mapping[str, Any]) -> None:
    if not isinstance(info.get("data_path"), str):
        raise PoolError(f"The file '{path}' is damaged: it has no 'data_path'.")
    if not isinstance(info.get("video_path"), str | None):
        raise PoolError(f"The file '{path}' is damaged: 'video_path' is no text.")
    size = info.get("chunks_size", layout.CHUNK_SIZE)
    if isinstance(size, bool) or not isinstance(size, int) or size < 1:
        raise PoolError(f"The file '{path}' is damaged: chunks_size is {size}.")


def _is_feature(spec: Any) -> bool:
    if not isinstance(spec, dict) or not isinstance(spec.get("dtype"), str):
        return False
    shape = spec.get("shape")
    return isinstance(shape, list) and all(isinstance(n, int) for n in shape)


def _read_manifest(root: Path) -> Mapping[str, Any]:
    path = root / layout.MANIFEST
    if not path.exists():
        return {}
    manifest = read_json(path)
    entries = manifest.get("episodes", [])
    names = manifest.get("subtasks", [])
    sums = manifest.get("sha256", {})
    lists = isinstance(entries, list) and isinstance(names, list) and isinstance(sums, dict)
    if not lists or not all(isinstance(entry, dict) for entry in entries):
        raise PoolError(f"The file '{path}' is damaged: it does not have the form of a manifest.")
    return manifest
