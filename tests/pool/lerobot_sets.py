"""Small LeRobot data sets as other tools write them; grey levels tell the frames apart."""

import io
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from PIL import Image

from teasim.pool.clips import VideoWriter

FPS = 10
SIZE = 16
KEY = "observation.images.top"
NAMES = ("reach", "grasp", "place")
DATA = "data/chunk-000/file-000.parquet"
EPISODES = "meta/episodes/chunk-000/file-000.parquet"
SENTENCES = pa.list_(
    pa.struct([("style", pa.string()), ("content", pa.string()), ("timestamp", pa.float32())])
)


@dataclass(frozen=True)
class Recipe:
    """What a data set is made of."""

    version: str = "v3.0"
    """Version of the format."""
    lengths: tuple[int, ...] = (6, 8, 5)
    """Frames of each demonstration."""
    kind: str = "video"
    """How pictures are stored: video or image."""
    keys: tuple[str, ...] = (KEY,)
    """Features with pictures."""
    labels: str = ""
    """Form of the sub-task labels: numbers, sparse, dense, sentences or none."""
    shared: bool = True
    """Whether all demonstrations of v3.0 are in one file."""
    tasks: tuple[str, ...] = ("stack", "stack", "sort")
    """Task of each demonstration."""


def level(episode: int, frame: int) -> int:
    """Grey level of a picture."""
    return 20 + 70 * episode + 7 * frame


def numbers(length: int) -> np.ndarray:
    """Sub-task of each frame: three of equal length, none in the first frame."""
    steps = np.arange(length) * len(NAMES) // length
    steps[0] = -1
    return steps


def make_set(root: Path, recipe: Recipe = Recipe()) -> Path:
    """Write a data set to `root`."""
    lines = recipe.version.startswith("v2")
    starts = np.cumsum([0, *recipe.lengths]).tolist()
    tables = [pa.table(_log(recipe, e, starts[e])) for e in range(len(recipe.lengths))]
    every = [[e] for e in range(len(tables))]
    groups = every if lines or not recipe.shared else [list(range(len(tables)))]
    for number, group in enumerate(groups):
        name = f"episode_{number:06d}" if lines else f"file-{number:03d}"
        data = root / f"data/chunk-000/{name}.parquet"
        data.parent.mkdir(parents=True, exist_ok=True)
        pq.write_table(pa.concat_tables([tables[e] for e in group]), data)
        for key in recipe.keys if recipe.kind == "video" else ():
            place = f"chunk-000/{key}" if lines else f"{key}/chunk-000"
            _write_video(root / f"videos/{place}/{name}.mp4", recipe, group)
    (root / "meta").mkdir(exist_ok=True)
    (_write_lines if lines else _write_tables)(root, recipe, starts, groups)
    (root / "meta/info.json").write_text(json.dumps(_info(recipe, starts[-1], lines)))
    return root


def _log(recipe: Recipe, episode: int, first: int) -> dict[str, pa.Array]:
    n = recipe.lengths[episode]
    frames = np.arange(n)
    state = np.stack([frames + 0.5 * episode, -frames], axis=1).astype(np.float32)
    vectors = pa.FixedSizeListArray.from_arrays(pa.array(state.ravel()), 2)
    columns = {"observation.state": vectors, "action": vectors}
    if recipe.kind == "image":
        stored = [{"bytes": _png(level(episode, f)), "path": f"{f}.png"} for f in range(n)]
        columns |= {key: pa.array(stored) for key in recipe.keys}
    if recipe.labels == "numbers":
        columns["subtask_index"] = pa.array(numbers(n))
    if recipe.labels == "sentences":
        said = [
            {"style": "subtask", "content": name, "timestamp": start / FPS}
            for name, start, _ in spans(n)
        ]
        other = {"style": "plan", "content": "be careful", "timestamp": 0.0}
        columns["language_persistent"] = pa.array([[*said, other]] * n, SENTENCES)
    tasks = list(dict.fromkeys(recipe.tasks))
    return columns | {
        "timestamp": pa.array((frames / FPS).astype(np.float32)),
        "frame_index": pa.array(frames),
        "episode_index": pa.array(np.full(n, episode)),
        "index": pa.array(frames + first),
        "task_index": pa.array(np.full(n, tasks.index(recipe.tasks[episode]))),
    }


def spans(length: int) -> list[tuple[str, int, int]]:
    """Name, first frame and end of each sub-task."""
    steps = numbers(length)
    found = [np.flatnonzero(steps == number) for number in range(len(NAMES))]
    return [(NAMES[i], int(f[0]), int(f[-1]) + 1) for i, f in enumerate(found) if f.size]


def _png(grey: int) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(np.full((SIZE, SIZE, 3), grey, np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def _write_video(path: Path, recipe: Recipe, group: Sequence[int]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    writer = VideoWriter(path, height=SIZE, width=SIZE, fps=FPS)
    for episode in group:
        for frame in range(recipe.lengths[episode]):
            writer.add(np.full((SIZE, SIZE, 3), level(episode, frame), np.uint8))
    writer.close()


def _write_lines(root: Path, recipe: Recipe, starts: list[int], groups: list[list[int]]) -> None:
    del starts, groups
    rows = [
        {"episode_index": e, "tasks": [recipe.tasks[e]], "length": n}
        for e, n in enumerate(recipe.lengths)
    ]
    tasks = list(dict.fromkeys(recipe.tasks))
    for name, content in (
        ("episodes", rows),
        ("tasks", [{"task_index": i, "task": task} for i, task in enumerate(tasks)]),
    ):
        text = "".join(json.dumps(row) + "\n" for row in content)
        (root / f"meta/{name}.jsonl").write_text(text)


def _write_tables(root: Path, recipe: Recipe, starts: list[int], groups: list[list[int]]) -> None:
    rows = []
    for number, group in enumerate(groups):
        for e in group:
            n = recipe.lengths[e]
            row: dict[str, Any] = {"episode_index": e, "tasks": [recipe.tasks[e]], "length": n}
            row |= {"data/chunk_index": 0, "data/file_index": number}
            row |= {"dataset_from_index": starts[e], "dataset_to_index": starts[e + 1]}
            begin = (starts[e] - starts[group[0]]) / FPS
            for key in recipe.keys if recipe.kind == "video" else ():
                row |= {f"videos/{key}/chunk_index": 0, f"videos/{key}/file_index": number}
                row |= {f"videos/{key}/from_timestamp": begin}
                row |= {f"videos/{key}/to_timestamp": begin + n / FPS}
            if recipe.labels in ("sparse", "dense"):
                row |= _annotation(recipe.labels, spans(n))
                if recipe.labels == "dense":
                    row |= _annotation("sparse", [("task", 0, n)])
            rows.append(row)
    (root / EPISODES).parent.mkdir(parents=True)
    pq.write_table(pa.table({k: [row[k] for row in rows] for k in rows[0]}), root / EPISODES)
    tasks = list(dict.fromkeys(recipe.tasks))
    pq.write_table(
        pa.table({"task_index": range(len(tasks)), "task": tasks}), root / "meta/tasks.parquet"
    )
    if recipe.labels == "numbers":
        names = pa.table({"subtask_index": range(len(NAMES)), "subtask": NAMES})
        pq.write_table(names, root / "meta/subtasks.parquet")


def _annotation(kind: str, told: Sequence[tuple[str, int, int]]) -> dict[str, list[Any]]:
    return {
        f"{kind}_subtask_names": [name for name, _, _ in told],
        f"{kind}_subtask_start_frames": [start for _, start, _ in told],
        f"{kind}_subtask_end_frames": [stop for _, _, stop in told],
    }


def _info(recipe: Recipe, total: int, lines: bool) -> dict[str, Any]:
    scalar = ["timestamp", "frame_index", "episode_index", "index", "task_index"]
    more = {"numbers": ["subtask_index"], "sentences": ["language_persistent"]}
    features: dict[str, Any] = {
        name: {"dtype": "float32", "shape": [2], "names": ["x", "y"]}
        for name in ("observation.state", "action")
    }
    for key in recipe.keys:
        features[key] = {"dtype": recipe.kind, "shape": [SIZE, SIZE, 3], "names": None}
    for name in [*more.get(recipe.labels, []), *scalar]:
        kinds = {"timestamp": "float32", "language_persistent": "language"}
        features[name] = {"dtype": kinds.get(name, "int64"), "shape": [1], "names": None}
    file = "episode_{episode_index:06d}" if lines else "file-{file_index:03d}"
    chunk = "chunk-{episode_chunk:03d}" if lines else "chunk-{chunk_index:03d}"
    video = f"{chunk}/{{video_key}}" if lines else f"{{video_key}}/{chunk}"
    return {
        "codebase_version": recipe.version,
        "fps": FPS,
        "total_episodes": len(recipe.lengths),
        "total_frames": total,
        "chunks_size": 1000,
        "splits": {"train": f"0:{len(recipe.lengths)}"},
        "data_path": f"data/{chunk}/{file}.parquet",
        "video_path": f"videos/{video}/{file}.mp4" if recipe.kind == "video" else None,
        "features": features,
    }


def rewrite_log(root: Path, change: Any, name: str = DATA) -> None:
    """Replace a parquet file by what `change` makes of its table."""
    pq.write_table(change(pq.read_table(root / name)), root / name)


def rewrite_info(root: Path, **changes: Any) -> None:
    """Change fields of meta/info.json."""
    path = root / "meta/info.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
