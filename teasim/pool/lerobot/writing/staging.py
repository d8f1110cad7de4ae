"""Where an unfinished pool waits: ROOT/.incomplete/, one folder per finished demonstration."""

import json
import os
import shutil
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa

from teasim.common.errors import PoolError
from teasim.common.files import sync, write_json
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.columns import read_table, write_table
from teasim.pool.lerobot.writing.statistics import ImageHistogram
from teasim.pool.types import EpisodeRecord, MistakeSpan, PoolHeader, Span

HEADER = "header.json"
COLUMNS = "columns.parquet"
RECORD = "record.json"


def claim_folder(root: Path, header: PoolHeader) -> None:
    """Make `root` the folder of an unfinished pool, or find that it already is that one.

    Raises:
        PoolError: `root` holds a finished pool, an unfinished one made with other settings, or
            files that are no pool. Nothing in it is touched then.
    """
    header_path = root / layout.STAGING / HEADER
    if (root / layout.INFO).exists():
        raise PoolError(
            f"The folder '{root}' already holds a finished pool; choose another folder or remove "
            f"it."
        )
    if header_path.exists():
        if _read_json(header_path) != header.as_json():
            raise PoolError(
                f"The folder '{root}' holds an unfinished pool made with other settings; "
                f"use the same settings to finish it, choose another folder, or remove it."
            )
        return
    if root.exists() and not root.is_dir():
        raise PoolError(f"'{root}' is a file; choose a folder that is new or empty.")
    if root.exists() and any(entry.name != layout.STAGING.name for entry in root.iterdir()):
        raise PoolError(
            f"The folder '{root}' is not empty and holds no pool; choose one that is new or empty."
        )
    try:
        write_json(header_path, header.as_json())
    except OSError as error:
        raise PoolError(f"The folder '{root}' cannot be written to: {error.strerror}.") from error


def episode_is_done(root: Path | str, index: int, header: PoolHeader) -> bool:
    """Whether demonstration `index` of an unfinished pool is complete, so it can be left out.

    Raises:
        PoolError: `root` belongs to something else (see `claim_folder`).
    """
    root = Path(root)
    claim_folder(root, header)
    return staged_folder(root, index).is_dir()


def staged_folder(root: Path, index: int) -> Path:
    """Where the finished demonstration `index` waits for the others."""
    return root / layout.STAGING / f"episode-{index:06d}"


@dataclass(frozen=True)
class StagedEpisode:
    """A finished demonstration that waits for the others."""

    folder: Path
    """Holds one mp4 per camera, columns.parquet and record.json."""
    columns: pa.Table
    """Per-frame columns but for those that need the other demonstrations (index, ...)."""
    record: EpisodeRecord
    """What the writer was told about it."""
    demo_id: str
    """Content-derived identity."""
    histograms: dict[str, ImageHistogram]
    """Image histogram per camera."""

    @property
    def length(self) -> int:
        """Number of frames."""
        n_rows: int = self.columns.num_rows
        return n_rows


def save_staged(episode: StagedEpisode, target: Path) -> None:
    """Write what goes beside the videos in `episode.folder`, then rename it to `target`."""
    write_table(episode.folder / COLUMNS, episode.columns)
    described: dict[str, Any] = {
        "demo_id": episode.demo_id,
        "record": record_as_json(episode.record),
        "histograms": {
            camera: {"counts": histogram.counts.tolist(), "n_frames": histogram.n_frames}
            for camera, histogram in episode.histograms.items()
        },
    }
    write_json(episode.folder / RECORD, described)
    for path in episode.folder.iterdir():
        sync(path)
    if target.exists():
        shutil.rmtree(target)
    os.replace(episode.folder, target)
    sync(target.parent)


def load_staged(folder: Path) -> StagedEpisode:
    """Read a finished demonstration back.

    Raises:
        PoolError: It is damaged.
    """
    described = _read_json(folder / RECORD)
    try:
        columns = read_table(folder / COLUMNS)
        histograms = {
            camera: ImageHistogram(np.asarray(stored["counts"]), stored["n_frames"])
            for camera, stored in described["histograms"].items()
        }
        record = record_from_json(described["record"])
        identity = described["demo_id"]
    except (KeyError, TypeError, ValueError, PoolError) as error:
        raise PoolError(
            f"The unfinished demonstration '{folder}' is damaged; remove it."
        ) from error
    return StagedEpisode(folder, columns, record, identity, histograms)


def record_as_json(record: EpisodeRecord) -> dict[str, Any]:
    """The record as plain lists, numbers and strings."""
    values = {part.name: getattr(record, part.name) for part in fields(record)}
    return values | {
        "mistakes": [vars(mistake) for mistake in record.mistakes],
        "spans": [vars(span) for span in record.spans],
    }


def record_from_json(stored: dict[str, Any]) -> EpisodeRecord:
    """The inverse of `record_as_json`."""
    parts = {
        "mistakes": tuple(MistakeSpan(**mistake) for mistake in stored["mistakes"]),
        "spans": tuple(Span(**span) for span in stored["spans"]),
    }
    return EpisodeRecord(**(stored | parts))


def _read_json(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise PoolError(f"The file '{path}' is damaged or missing; remove its folder.") from error
