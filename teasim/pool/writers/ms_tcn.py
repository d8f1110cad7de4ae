"""An MS-TCN folder: a label per frame and line; a video is named after its demo_id."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from teasim.common.errors import ConfigError
from teasim.pool.mstcn.arrays import read_array, write_array
from teasim.pool.mstcn.folder import write_predictions
from teasim.pool.mstcn.labels import BACKGROUNDS
from teasim.pool.types import NO_SUBTASK, index_from_spans
from teasim.pool.weight_table import WeightRow, write_weight_table
from teasim.pool.writers.content import Content, Item
from teasim.pool.writers.pictures import safe_names
from teasim.pool.writers.writer import Writer

LABELS, POSTERIORS = "labels.json", "posteriors.npy"


def check(content: Content) -> None:
    """Refuse names of sub-tasks that mean none, and labels that nobody gave.

    Raises:
        ConfigError: a sub-task is named as frames without one are, or no frame has a label.
    """
    for name in content.subtasks:
        if name in BACKGROUNDS or not name.strip():
            raise ConfigError(f"'{name}' stands for frames without a sub-task; name it otherwise.")


def stage(content: Content, item: Item, folder: Path) -> None:
    """Write the labels of one video, true and predicted.

    Raises:
        PoolError: the source is damaged.
    """
    demo = item.demo
    truth, predicted = (demo.spans(), item.spans) if content.found else (item.spans, ())
    predicted = predicted or demo.predicted_spans()
    names = _names(content, [span.subtask for span in (*truth, *predicted)])
    numbers = {
        kind: index_from_spans(spans, names, demo.length).tolist() if spans else None
        for kind, spans in (("truth", truth), ("predicted", predicted))
    }
    told = {"names": names, **numbers}
    (folder / LABELS).write_text(json.dumps(told, ensure_ascii=False), encoding="utf-8")
    posteriors = demo.posteriors()
    if posteriors is not None:
        write_array(folder / POSTERIORS, posteriors)


def assemble(content: Content, folders: Sequence[Path], out: Path) -> list[str]:
    """Make one folder of the labels of all videos."""
    staged = [json.loads((folder / LABELS).read_text(encoding="utf-8")) for folder in folders]
    names = _names(content, [name for one in staged for name in one["names"]])
    ids = safe_names([item.demo.demo_id for item in content.items])
    videos = [ids[item.demo.demo_id] for item in content.items]
    labels: dict[str, dict[str, np.ndarray]] = {"truth": {}, "predicted": {}}
    for video, one in zip(videos, staged, strict=True):
        order = np.array([*map(names.index, one["names"]), NO_SUBTASK])
        for kind, of_kind in labels.items():
            if one[kind] is not None:
                of_kind[video] = order[np.array(one[kind])]
    stored = {video: f / POSTERIORS for video, f in zip(videos, folders, strict=True)}
    posteriors = {
        video: read_array(path).astype(np.float32)
        for video, path in stored.items()
        if path.exists()
    }
    write_predictions(out, names, labels["predicted"], labels["truth"], posteriors)
    rows: list[WeightRow] = [item.verdict for item in content.items if item.verdict is not None]
    if rows:
        write_weight_table(out / "weights.csv", rows)
    return []


def _names(content: Content, used: Sequence[str]) -> list[str]:
    """Return the names of all labels: those of the content first, in their order."""
    return list(dict.fromkeys([*content.subtasks, *used]))


WRITER = Writer("ms-tcn", "MS-TCN folder", stage, assemble, check, pictures=False, labels=True)
