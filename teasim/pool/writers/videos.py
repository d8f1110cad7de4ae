"""Folders of videos: CAMERA/DEMONSTRATION.mp4, with the labels in tables beside them."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from teasim.common.files import link_or_copy
from teasim.pool.readers.video_labels import DemoRow, LabelRow, write_tables
from teasim.pool.readers.videos import natural
from teasim.pool.weight_table import write_weight_table
from teasim.pool.writers.content import Content, Item
from teasim.pool.writers.pictures import encoding_note, safe_names, write_mp4
from teasim.pool.writers.writer import Writer

COPIED = "copied.json"


def stage(content: Content, item: Item, folder: Path) -> None:
    """Write one mp4 per camera.

    Raises:
        PoolError: the source is damaged, or the encoder fails.
    """
    frames, copied = np.arange(item.demo.length), []
    for camera, name in safe_names(content.cameras).items():
        path = folder / f"{name}.mp4"
        fps = content.fps or 1.0
        copied.append(write_mp4(item.demo.clip(camera), frames, path, fps=fps))
    (folder / COPIED).write_text(json.dumps(copied), encoding="utf-8")


def assemble(content: Content, folders: Sequence[Path], out: Path) -> list[str]:
    """Sort the videos into a folder per camera and write the tables."""
    names = _names(content)
    for name, folder in zip(names, folders, strict=True):
        for camera in safe_names(content.cameras).values():
            link_or_copy(folder / f"{camera}.mp4", out / camera / f"{name}.mp4")
    labels = [
        LabelRow(name, span.subtask, span.start, span.stop)
        for name, item in zip(names, content.items, strict=True)
        for span in item.spans
    ]
    demos = [
        DemoRow(name, item.demo.demo_id, item.demo.task)
        for name, item in zip(names, content.items, strict=True)
    ]
    write_tables(out, demos, labels)
    if content.judged:
        rows = [item.verdict for item in content.items if item.verdict is not None]
        write_weight_table(out / "weights.csv", rows)
    copied = [c for f in folders for c in json.loads((f / COPIED).read_text(encoding="utf-8"))]
    return list(encoding_note(copied))


def _names(content: Content) -> list[str]:
    """Return the file name of each demonstration: its own, if these sort in the same order."""
    own = [item.demo.name for item in content.items]
    safe = safe_names(own, r"[/\x00-\x1f]")
    names = [safe[name] for name in own]
    if len(safe) == len(own) and names == sorted(names, key=natural):
        return names
    return [f"{item.number:06d}" for item in content.items]


WRITER = Writer("videos", "folder of videos", stage, assemble)
