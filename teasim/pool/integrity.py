"""Is a pool what its metadata say? Every problem is one sentence that names the file."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from teasim.common.errors import PoolError
from teasim.common.files import sha256_of
from teasim.pool.clips import check_decodable, probe
from teasim.pool.lerobot import layout
from teasim.pool.lerobot.identity import ID_PREFIX
from teasim.pool.lerobot.metadata import require_pool_folder
from teasim.pool.lerobot.reader import Episode, Pool
from teasim.pool.types import NO_SUBTASK

TIME_TOLERANCE = 1e-3
"""Largest deviation of a timestamp from frame_index / fps [s]."""

LENGTH_TOLERANCE = 0.9
"""Largest difference of a video and its logs [frames]; one frame is told in spite of rounding."""

NOT_NUMBERS = ("video", "image", "string", "language")
"""Kinds of features whose columns, if any, are not checked."""


def check_pool(path: Path | str) -> list[str]:
    """Look for damage in a pool.

    Files whose check sum is known are compared with it; other videos are decoded in full.

    Returns:
        One sentence per problem; empty when the pool is sound.

    Raises:
        PoolError: There is no pool at `path` at all.
    """
    root = Path(path)
    require_pool_folder(root)
    try:
        pool = Pool.open(root)
    except PoolError as error:
        return [str(error)]
    problems = []
    for check in (_check_totals, _check_check_sums, _check_logs, _check_videos, _check_identities):
        problems += list(check(pool))
    return list(dict.fromkeys(problems))


def _check_totals(pool: Pool) -> Iterator[str]:
    """Do info.json and the episodes table add up?"""
    rows = [episode.row for episode in pool.episodes]
    counted = {
        "total_episodes": len(rows),
        "total_frames": sum(episode.length for episode in pool.episodes),
    }
    for name, count in counted.items():
        told = pool.info.get(name)
        if told != count:
            yield f"'{layout.INFO}' says {name} is {told} but the episodes table has {count}."
    if [episode.index for episode in pool.episodes] != list(range(len(rows))):
        yield f"The demonstrations are not numbered 0 to {len(rows) - 1} without a gap."
    expected = 0
    for row in rows:
        start, stop = row["dataset_from_index"], row["dataset_to_index"]
        if (start, stop) != (expected, expected + row["length"]):
            yield (
                f"Demonstration {row['episode_index']} covers the frames {start} to {stop} of the "
                f"pool, but {expected} to {expected + row['length']} is its place."
            )
        expected = stop


def _check_check_sums(pool: Pool) -> Iterator[str]:
    """Are the files the ones that were written?"""
    for name, told in pool.manifest.get("sha256", {}).items():
        path = pool.root / name
        if not path.is_file():
            yield f"The file '{path}' is missing."
        elif sha256_of(path) != told:
            yield f"The file '{path}' is damaged: its check sum is not the one of the manifest."


def _check_logs(pool: Pool) -> Iterator[str]:
    for episode in pool.episodes:
        yield from _sentences(partial(_check_log, pool, episode))


def _check_log(pool: Pool, episode: Episode) -> Iterator[str]:
    """One demonstration's rows: all there, finite, counted and timed as they should be."""
    where = f"in the log '{episode.data_path}' of demonstration {episode.index}"
    for name, feature in pool.info["features"].items():
        if feature["dtype"] in NOT_NUMBERS:
            continue
        values = episode.column(name)
        if np.issubdtype(values.dtype, np.floating) and not np.isfinite(values).all():
            frame = int(np.argwhere(~np.isfinite(values))[0][0])
            yield f"'{name}' is not a finite number at frame {frame} {where}."
        wrong = _misnumbered(pool, episode, name, values)
        if wrong:
            yield f"{wrong} {where}."
    episode.spans()
    if episode.record is not None and any(m.stop > episode.length for m in episode.record.mistakes):
        yield f"A mistake lies outside demonstration {episode.index}."


def _misnumbered(pool: Pool, episode: Episode, name: str, values: np.ndarray) -> str | None:
    """What is wrong with a column that numbers the frames, or None."""
    frames = np.arange(episode.length)
    first = episode.row["dataset_from_index"]
    if name == "frame_index" and not np.array_equal(values, frames):
        return "'frame_index' does not count the frames from 0"
    if name == "index" and not np.array_equal(values, frames + first):
        return f"'index' does not count the frames from {first}"
    if name == "episode_index" and (values != episode.index).any():
        return "There are rows of another demonstration"
    if name == "timestamp" and _off_grid(values, pool.fps):
        return f"The timestamps are not the frame numbers divided by {pool.fps}"
    if name == layout.SUBTASK_INDEX and pool.subtasks and _unnamed(values, pool.subtasks):
        return "There is a sub-task number without a name"
    return None


def _off_grid(timestamps: np.ndarray, fps: float) -> bool:
    grid = np.arange(len(timestamps)) / fps
    return bool((np.abs(timestamps - grid) > TIME_TOLERANCE).any())


def _unnamed(subtask_index: np.ndarray, subtasks: tuple[str, ...]) -> bool:
    return bool(((subtask_index < NO_SUBTASK) | (subtask_index >= len(subtasks))).any())


def _check_videos(pool: Pool) -> Iterator[str]:
    for camera in pool.cameras:
        ends: dict[Path, tuple[float, int]] = {}
        for episode in pool.episodes:
            clip = episode.clip(camera)
            end = clip.start * clip.fps + clip.length
            ends[clip.path] = max(ends.get(clip.path, (0.0, 0)), (end, episode.index))
        for path, (end, last) in ends.items():
            yield from _sentences(partial(_check_video, pool, path, end, last))


def _check_video(pool: Pool, path: Path, end: float, last: int) -> Iterator[str]:
    """One video: it decodes, and it lasts as long as the logs of the demonstrations in it.

    Lengths are compared in frames of the pool, because a camera may have a rate of its own.
    """
    name = path.relative_to(pool.root).as_posix()
    known = name in pool.manifest.get("sha256", {})
    n_frames = probe(path).n_frames if known else check_decodable(path)
    shown = n_frames * pool.fps / probe(path).fps
    if end - shown > LENGTH_TOLERANCE:
        yield (
            f"The video '{path}' is shorter than the log: it has {shown:.0f} frames but "
            f"demonstration {last} ends at frame {end:.0f}."
        )
    if shown - end > LENGTH_TOLERANCE:
        yield (
            f"The log of demonstration {last} is shorter than its video '{path}': it ends at frame "
            f"{end:.0f} of {shown:.0f}."
        )


def _check_identities(pool: Pool) -> Iterator[str]:
    for episode in pool.episodes:
        yield from _sentences(partial(_check_identity, episode))


def _check_identity(episode: Episode) -> Iterator[str]:
    """Is the demonstration the one its stored identity was made from?"""
    told = episode.row.get("teasim/demo_id")
    if told and told.startswith(ID_PREFIX) and episode.content_id() != told:
        yield f"Demonstration {episode.index} is not the one that was written as {told}."


def _sentences(check: Callable[[], Iterator[str]]) -> Iterator[str]:
    """What `check` finds, and what it trips over."""
    try:
        yield from check()
    except PoolError as error:
        yield str(error)
