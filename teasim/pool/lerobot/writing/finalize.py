"""Turning finished demonstrations into a pool: numbers, statistics and metadata, then a rename."""

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from teasim.common.errors import PoolError
from teasim.common.files import sync
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.reader import Pool
from teasim.pool.lerobot.writing.assembly import Assembly, Outline, Part, truth_columns
from teasim.pool.lerobot.writing.staging import (
    StagedEpisode,
    claim_folder,
    load_staged,
    record_as_json,
    staged_folder,
)
from teasim.pool.types import GroundTruth, PoolHeader

MANIFEST_FORMAT = "teasim-pool"
"""Tells our manifests from other files."""
MANIFEST_VERSION = 1
"""Increased when a reader of the old manifest could not read the new one."""


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
    Assembly(assembled, _outline(header, staged), [_part(e) for e in staged]).write()
    for folder in ("data", "videos", "teasim", "meta"):
        shutil.rmtree(root / folder, ignore_errors=True)
        if (assembled / folder).exists():  # without a camera there is no folder of videos
            (assembled / folder).rename(root / folder)
    sync(root)
    shutil.rmtree(root / layout.STAGING)
    return Pool.open(root)


def _outline(header: PoolHeader, episodes: Sequence[StagedEpisode]) -> Outline:
    features = layout.features_of(header)
    manifest = {
        "format": MANIFEST_FORMAT,
        "version": MANIFEST_VERSION,
        **header.as_json(),
        "features": sorted(features),
        "episodes": [
            {"episode_index": i, "demo_id": e.demo_id} | record_as_json(e.record)
            for i, e in enumerate(episodes)
        ],
    }
    return Outline(
        header.fps,
        header.cameras,
        features,
        header.subtasks,
        header.robot_type,
        manifest=manifest,
    )


def _part(episode: StagedEpisode) -> Part:
    record = episode.record
    known: dict[str, Any] = {
        name: getattr(record, name) for name in GroundTruth.__dataclass_fields__
    }
    return Part(
        folder=episode.folder,
        columns=episode.columns,
        histograms=episode.histograms,
        task=record.task,
        spans=record.spans,
        facts={"teasim/demo_id": episode.demo_id, **truth_columns(GroundTruth(**known))},
    )
