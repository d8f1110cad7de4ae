"""LeRobotDataset v2.1: an mp4 and a parquet file per demonstration, metadata as JSON lines."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from teasim.common.files import link_or_copy, write_json, write_text
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.writing.assembly import Assembly, write_parquet
from teasim.pool.writers.content import Content
from teasim.pool.writers.lerobot import parts as lerobot_parts
from teasim.pool.writers.lerobot.verdicts import write_verdicts
from teasim.pool.writers.writer import Writer

VERSION = "v2.1"
DATA_PATH = "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"
VIDEO_PATH = "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"
STATISTICS = ("min", "max", "mean", "std", "count")
"""Statistics of v2.1, which has no quantiles."""


def assemble(content: Content, folders: Sequence[Path], out: Path) -> list[str]:
    """Make a data set of the staged demonstrations."""
    parts = lerobot_parts.load(folders)
    data = Assembly(out, lerobot_parts.outline(content, parts), parts)
    for number, part in enumerate(parts):
        place = {"episode_chunk": number // layout.CHUNK_SIZE, "episode_index": number}
        write_parquet(out / DATA_PATH.format(**place), data.tables[number])
        for camera in data.outline.cameras:
            path = VIDEO_PATH.format(video_key=layout.CAMERA_PREFIX + camera, **place)
            link_or_copy(part.folder / f"{camera}.mp4", out / path)
    _write_lines(
        out / layout.TASKS_LINES,
        [{"task_index": number, "task": task} for number, task in enumerate(data.tasks)],
    )
    _write_lines(out / layout.EPISODES_LINES, [_episode(data, n) for n in range(len(parts))])
    _write_lines(out / "meta/episodes_stats.jsonl", [_stats(data, n) for n in range(len(parts))])
    if data.outline.labelled:
        names = dict(enumerate(data.outline.subtasks))
        _write_lines(
            out / "meta/subtasks.jsonl",
            [{"subtask_index": number, "subtask": name} for number, name in names.items()],
        )
    write_json(out / layout.MANIFEST, data.manifest())
    write_json(out / layout.INFO, _info(data))
    write_verdicts(out, content, [part.length for part in parts])
    return lerobot_parts.notes(content, folders)


def _episode(data: Assembly, number: int) -> dict[str, Any]:
    part = data.parts[number]
    known = {name: value for name, value in part.facts.items() if value is not None}
    row = {"episode_index": number, "tasks": [part.task], "length": part.length}
    return {**row, **known, **data.span_columns(number)}


def _stats(data: Assembly, number: int) -> dict[str, Any]:
    stats = {
        feature: {name: values for name, values in block.items() if name in STATISTICS}
        for feature, block in data.episode_stats(number).items()
    }
    return {"episode_index": number, "stats": stats}


def _info(data: Assembly) -> dict[str, Any]:
    n_videos = len(data.parts) * len(data.outline.cameras)
    n_chunks = (len(data.parts) - 1) // layout.CHUNK_SIZE + 1
    counts = {"total_videos": n_videos, "total_chunks": n_chunks}
    paths = {"data_path": DATA_PATH, "video_path": VIDEO_PATH}
    info = {**data.info(), **counts, "codebase_version": VERSION, **paths}
    return {name: value for name, value in info.items() if not name.endswith("_size_in_mb")}


def _write_lines(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    write_text(path, "".join(json.dumps(row, ensure_ascii=False) + "\n" for row in rows))


WRITER = Writer(
    "lerobot-v2.1", "LeRobot data set", lerobot_parts.stage, assemble, check=lerobot_parts.check
)
