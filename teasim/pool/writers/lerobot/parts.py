"""Demonstrations as parts of a LeRobot data set: what its versions have in common."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from teasim.pool.clips import probe
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import read_table, write_table
from teasim.pool.lerobot.labels import STYLE
from teasim.pool.lerobot.writing.assembly import Outline, Part, truth_columns
from teasim.pool.lerobot.writing.statistics import FRAME_STRIDE, ImageHistogram
from teasim.pool.types import Span, index_from_spans
from teasim.pool.weight_table import WeightRow
from teasim.pool.writers.content import Content, Item, sampled, sampled_spans
from teasim.pool.writers.pictures import encoding_note, require_one_size, safe_names, write_mp4

COLUMNS, FACTS = "columns.parquet", "part.json"
REWARD, SUCCESS, DONE = "next.reward", "next.success", "next.done"
SENTENCES = pa.list_(
    pa.struct(
        [
            *((name, pa.string()) for name in ("role", "content", "style")),
            ("timestamp", pa.float32()),
            ("camera", pa.string()),
            ("tool_calls", pa.list_(pa.string())),
        ]
    )
)
"""Type of `language_persistent` since LeRobot 0.6."""


def check(content: Content) -> None:
    """Refuse content that a LeRobot data set cannot hold; see `require_one_size`."""
    require_one_size(content)


def rate_of(content: Content) -> int:
    """Return the frame rate of the data set: the whole number nearest to that of the source."""
    return max(round(content.fps or 1), 1)


def stage(content: Content, item: Item, folder: Path) -> None:
    """Write the videos, the log and the facts of one demonstration into `folder`.

    Raises:
        PoolError: the source is damaged, or the encoder fails.
    """
    rate = rate_of(content)
    frames = sampled(item.demo.length, content.fps or rate, rate)
    spans = sampled_spans(item.spans, frames)
    histograms, copied = {}, []
    for camera, name in safe_names(content.cameras).items():
        histogram = histograms[name] = ImageHistogram()

        def seen(place: int, image: np.ndarray, histogram: ImageHistogram = histogram) -> None:
            if place % FRAME_STRIDE == 0:
                histogram.add(image)

        path = folder / f"{name}.mp4"
        copied.append(write_mp4(item.demo.clip(camera), frames, path, fps=rate, seen=seen))
    write_table(folder / COLUMNS, _columns(content, item, frames, spans))
    facts = {
        "task": item.demo.task,
        "spans": [vars(span) for span in spans],
        "facts": {
            "teasim/demo_id": item.demo.demo_id,
            **(truth_columns(item.demo.record) if item.demo.record else {}),
            **_verdict_columns(item.verdict),
        },
        "histograms": {
            name: {"counts": h.counts.tolist(), "n_frames": h.n_frames}
            for name, h in histograms.items()
        },
        "copied": copied,
    }
    (folder / FACTS).write_text(json.dumps(facts), encoding="utf-8")


def load(folders: Sequence[Path]) -> list[Part]:
    """Return the staged demonstrations."""
    told = [json.loads((folder / FACTS).read_text(encoding="utf-8")) for folder in folders]
    names = dict.fromkeys(name for facts in told for name in facts["facts"])
    return [
        Part(
            folder=folder,
            columns=read_table(folder / COLUMNS),
            histograms={
                camera: ImageHistogram(np.asarray(stored["counts"]), stored["n_frames"])
                for camera, stored in facts["histograms"].items()
            },
            task=facts["task"],
            spans=tuple(Span(**span) for span in facts["spans"]),
            facts={name: facts["facts"].get(name) for name in names},
        )
        for folder, facts in zip(folders, told, strict=True)
    ]


def outline(content: Content, parts: Sequence[Part]) -> Outline:
    """Return what the demonstrations have in common; videos are as those of the first one."""
    rate, cameras = rate_of(content), safe_names(content.cameras)
    videos = {name: parts[0].folder / f"{name}.mp4" for name in cameras.values()}
    episodes = [
        {"episode_index": number, "demo_id": part.facts["teasim/demo_id"]}
        for number, part in enumerate(parts)
    ]
    manifest = {"fps": rate, "subtasks": list(content.subtasks), "episodes": episodes}
    return Outline(
        fps=rate,
        cameras=tuple(cameras.values()),
        features=_features(content, videos),
        subtasks=content.subtasks,
        labelled=bool(content.subtasks),
        manifest=manifest,
    )


def notes(content: Content, folders: Sequence[Path]) -> list[str]:
    """Return what came out otherwise than one may expect."""
    rate = rate_of(content)
    told = []
    if rate != content.fps:
        told.append(
            f"LeRobot needs a whole number of frames per second: {rate} in place of "
            f"{content.fps:.5g}, frames matched by time."
        )
    renamed = {old: new for old, new in safe_names(content.cameras).items() if old != new}
    if renamed:
        pairs = ", ".join(f"'{old}' is now '{new}'" for old, new in renamed.items())
        told.append(f"Names of cameras were changed to what LeRobot allows: {pairs}.")
    copied = [
        c for f in folders for c in json.loads((f / FACTS).read_text(encoding="utf-8"))["copied"]
    ]
    return [*told, *encoding_note(copied)]


def _columns(content: Content, item: Item, frames: np.ndarray, spans: Sequence[Span]) -> pa.Table:
    """Return the per-frame columns but for those that need the other demonstrations."""
    length, rate = len(frames), rate_of(content)
    columns: dict[str, pa.Array] = {}
    for name in content.logs:
        values = item.demo.log(name)[frames]
        if name == SUCCESS:
            columns[name] = pa.array(values[:, 0] > 0)
        elif values.shape[1] == 1:
            columns[name] = pa.array(values[:, 0])
        else:
            flat = pa.array(values.ravel())
            columns[name] = pa.FixedSizeListArray.from_arrays(flat, values.shape[1])
    if content.subtasks:
        columns[layout.SUBTASK_INDEX] = pa.array(index_from_spans(spans, content.subtasks, length))
    columns[DONE] = pa.array(np.arange(length) == length - 1)
    if content.subtasks and content.language:
        columns[layout.LANGUAGE] = pa.array([_sentences(spans, rate)] * length, SENTENCES)
    columns["timestamp"] = pa.array((np.arange(length) / rate).astype(np.float32))
    columns["frame_index"] = pa.array(np.arange(length, dtype=np.int64))
    return pa.table(columns)


def _sentences(spans: Sequence[Span], rate: int) -> list[dict[str, Any]]:
    said = {"role": "assistant", "style": STYLE, "camera": None, "tool_calls": None}
    return [{**said, "content": span.subtask, "timestamp": span.start / rate} for span in spans]


def _features(content: Content, videos: Mapping[str, Path]) -> dict[str, dict[str, Any]]:
    """Return the features of info.json."""
    features = {
        name: layout.vector(names) for name, names in content.logs.items() if name[:5] != "next."
    }
    for camera, path in videos.items():
        info = probe(path)
        features[layout.CAMERA_PREFIX + camera] = layout.video(
            height=info.height, width=info.width, fps=rate_of(content)
        )
    scalars = {layout.SUBTASK_INDEX: "int64"} if content.subtasks else {}
    outcomes = {REWARD: "float32", SUCCESS: "bool"}
    scalars |= {name: kind for name, kind in outcomes.items() if name in content.logs}
    scalars |= {DONE: "bool"}
    if content.subtasks and content.language:
        scalars[layout.LANGUAGE] = "language"
    scalars["timestamp"] = "float32"
    numbers = ("frame_index", "episode_index", "index", "task_index")
    scalars |= dict.fromkeys(numbers, "int64")
    return features | {name: layout.scalar(kind) for name, kind in scalars.items()}


def _verdict_columns(verdict: WeightRow | None) -> dict[str, Any]:
    if verdict is None:
        return {}
    names = ("weight", "loss", "flagged", "group", "reason")
    return {f"teasim/{name}": getattr(verdict, name) for name in names}
