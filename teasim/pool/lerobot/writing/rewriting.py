"""A copy of a data set with some of its demonstrations, numbered anew; pictures stay as encoded."""

import json
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from teasim.common.files import sha256_of, write_json, write_text
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import read_table, write_table
from teasim.pool.lerobot.describing.documents import read_lines
from teasim.pool.lerobot.describing.metadata import Metadata
from teasim.pool.lerobot.episode import Episode
from teasim.pool.lerobot.reader import Pool

EPISODE_STATS_LINES = Path("meta/episodes_stats.jsonl")
"""Statistics of each demonstration in v2.1."""
WRITTEN_ANEW = (layout.INFO, layout.EPISODES_LINES, EPISODE_STATS_LINES, layout.MANIFEST)
"""Files that name demonstrations by number."""


def rewrite(pool: Pool, kept: Sequence[int], target: Path) -> None:
    """Write the demonstrations `kept` of `pool` to the folder `target`.

    Args:
        pool: Any LeRobot data set.
        kept: Numbers of its demonstrations, ascending.
        target: An empty folder.

    Raises:
        PoolError: A file of a demonstration that is kept is missing or damaged.
    """
    episodes = [episode for episode in pool.episodes if episode.index in set(kept)]
    meta = replace(pool.metadata, root=target)
    _copy_documents(pool.root, target)
    places = _write_logs(episodes, meta)
    for new, episode in enumerate(episodes):
        for key, path in episode.video_files().items():
            copy = meta.video_path(_renumbered(episode, new), key)
            copy.parent.mkdir(parents=True, exist_ok=True)
            if not copy.exists():
                shutil.copyfile(path, copy)
    if pool.metadata.has_lines:
        for name in (layout.EPISODES_LINES, EPISODE_STATS_LINES):
            _write_lines(pool.root / name, target / name, kept)
    else:
        _write_episodes(pool.root, target, kept, places)
    write_json(target / layout.INFO, _info(pool.info, episodes))
    if pool.manifest:
        write_json(target / layout.MANIFEST, _manifest(pool, episodes, target))


def write_rows(episode: Episode, target: Path) -> None:
    """Write the rows that a data file has of a demonstration, as they are.

    Raises:
        PoolError: The file is missing or damaged.
    """
    rows = episode.log_rows()
    table = read_table(rows.path).take(pa.array(rows.places))
    target.parent.mkdir(parents=True, exist_ok=True)
    write_table(target, table)


def _copy_documents(root: Path, target: Path) -> None:
    """What is said about the data set as a whole: files at the top and in meta."""
    for folder in (Path(), Path("meta")):
        for path in sorted((root / folder).iterdir()):
            name = path.relative_to(root)
            if path.is_file() and name not in WRITTEN_ANEW:
                (target / folder).mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target / name)


def _write_logs(episodes: Sequence[Episode], meta: Metadata) -> list[int]:
    """Write the data files; return the first frame of each demonstration and the end of all."""
    places = np.cumsum([0, *(episode.length for episode in episodes)]).tolist()
    files: dict[Path, list[int]] = {}
    for new, episode in enumerate(episodes):
        copy = meta.data_path(_renumbered(episode, new))
        files.setdefault(copy, []).append(new)
    for copy, numbers in files.items():
        whole = read_table(episodes[numbers[0]].data_path)
        parts = [_log_of(whole, episodes[new], new, places[new]) for new in numbers]
        copy.parent.mkdir(parents=True, exist_ok=True)
        write_table(copy, pa.concat_tables(parts))
    return places


def _log_of(whole: pa.Table, episode: Episode, new: int, first: int) -> pa.Table:
    part = whole.take(pa.array(episode.log_rows().places))
    length = len(part)
    values = {
        "episode_index": np.full(length, new, dtype=np.int64),
        "index": np.arange(first, first + length, dtype=np.int64),
    }
    return _with_columns(part, values)


def _with_columns(table: pa.Table, values: Mapping[str, Any]) -> pa.Table:
    for name in set(values) & set(table.column_names):
        table = table.set_column(table.column_names.index(name), name, pa.array(values[name]))
    return table


def _renumbered(episode: Episode, new: int) -> dict[str, Any]:
    return {**episode.row, "episode_index": new}


def _write_episodes(root: Path, target: Path, kept: Sequence[int], places: Sequence[int]) -> None:
    files = sorted((root / layout.EPISODES_FOLDER).rglob("*.parquet"))
    table = pa.concat_tables(map(read_table, files), promote_options="permissive")
    table = table.filter(
        pc.is_in(pc.cast(_single(table["episode_index"]), pa.int64()), pa.array(kept))
    )
    order = np.argsort(np.asarray(_single(table["episode_index"])), kind="stable")
    zeros = np.zeros(len(kept), dtype=np.int64)
    values = {
        "episode_index": np.arange(len(kept)),
        "dataset_from_index": np.array(places[:-1], dtype=np.int64),
        "dataset_to_index": np.array(places[1:], dtype=np.int64),
        "meta/episodes/chunk_index": zeros,
        "meta/episodes/file_index": zeros,
    }
    path = target / layout.EPISODES
    path.parent.mkdir(parents=True, exist_ok=True)
    write_table(path, _with_columns(table.take(pa.array(order)), values))


def _single(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """A column whose values may be lists of one."""
    nested = pa.types.is_list(column.type) or pa.types.is_fixed_size_list(column.type)
    return pc.list_flatten(column) if nested else column


def _write_lines(source: Path, target: Path, kept: Sequence[int]) -> None:
    if not source.is_file():
        return
    by_index = {int(line.get("episode_index", -1)): line for line in read_lines(source)}
    lines = [
        json.dumps(by_index[old] | {"episode_index": new}, ensure_ascii=False)
        for new, old in enumerate(kept)
        if old in by_index
    ]
    write_text(target, "".join(line + "\n" for line in lines))


def _info(info: Mapping[str, Any], episodes: Sequence[Episode]) -> dict[str, Any]:
    counts = {
        "total_episodes": len(episodes),
        "total_frames": sum(episode.length for episode in episodes),
        "splits": {"train": f"0:{len(episodes)}"},
    }
    if "total_videos" in info:
        counts["total_videos"] = sum(len(episode.video_files()) for episode in episodes)
    return {**info, **counts}


def _manifest(pool: Pool, episodes: Sequence[Episode], target: Path) -> dict[str, Any]:
    known = {entry.get("episode_index"): entry for entry in pool.manifest.get("episodes", ())}
    entries = [
        known[episode.index] | {"episode_index": new}
        for new, episode in enumerate(episodes)
        if episode.index in known
    ]
    found = (path for part in ("data", "videos") for path in (target / part).rglob("*"))
    sums = {p.relative_to(target).as_posix(): sha256_of(p) for p in sorted(found) if p.is_file()}
    return {**pool.manifest, "episodes": entries, "sha256": sums}
