"""What shows without decoding a picture: files, lengths, numbers and times held against each other.

A *problem* is damage, for which every verb refuses the data set. A *note* is unusual, harms
nothing and is printed as a warning.
"""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pyarrow as pa

from teasim.common.errors import PoolError
from teasim.common.files import sha256_of
from teasim.pool.clips import probe
from teasim.pool.lerobot.columns import as_numpy, read_columns
from teasim.pool.lerobot.describing.features import NOT_NUMBERS
from teasim.pool.lerobot.describing.metadata import Metadata, metadata_notes
from teasim.pool.lerobot.describing.places import inside
from teasim.pool.lerobot.episode import Episode
from teasim.pool.lerobot.log import TIME_TOLERANCE

FRAME = 0.9
"""Lengths that differ by less than this share of a frame are equal; times are rounded."""
OFF_GRID = 0.05
"""Distance of a demonstration's begin from the grid of frames that is told, as a share of one."""


@dataclass(frozen=True)
class Problem:
    """Damage."""

    text: str
    """A sentence that names the file."""
    episode: int | None = None
    """Number of the demonstration it is in; None where it concerns them all."""


@dataclass(frozen=True)
class Findings:
    """What was found."""

    problems: list[Problem]
    """Damage, each once."""
    notes: list[str]
    """What is unusual."""


def look_at(meta: Metadata, episodes: Sequence[Episode]) -> Findings:
    """Hold metadata, logs and videos against each other."""
    problems = [*_rewritten(meta, episodes), *_too_long(meta, episodes)]
    for episode in episodes:
        for check in (_check_log, _check_labels, _check_videos):
            found = sentences(partial(check, meta, episode))
            problems += [Problem(text, episode.index) for text in found]
    notes = [*metadata_notes(meta), *_other_writer(meta), *_notes(meta, episodes)]
    return Findings(list(dict.fromkeys(problems)), list(dict.fromkeys(notes)))


def sentences(check: Callable[[], Iterator[str]]) -> Iterator[str]:
    """Yield what `check` finds, and what it trips over."""
    try:
        yield from check()
    except PoolError as error:
        yield str(error)


def _rewritten(meta: Metadata, episodes: Sequence[Episode]) -> Iterator[Problem]:
    """Are the files the ones that were written? A file counts for the demonstrations in it."""
    changed = dict(_changed_files(meta))
    if not changed:
        return
    used = set()
    for episode in episodes:
        files = {episode.data_path, *episode.video_files().values()}
        yield from (Problem(changed[path], episode.index) for path in changed if path in files)
        used |= files
    yield from (Problem(text) for path, text in changed.items() if path not in used)


def _changed_files(meta: Metadata) -> Iterator[tuple[Path, str]]:
    stale = bool(list(_other_writer(meta)))
    for name, told in meta.manifest.get("sha256", {}).items():
        parts = [*name.split("/"), ""]
        if stale and (parts[0] == "data" or parts[1] not in meta.features):
            continue
        try:
            path = inside(meta.root, name, meta.homes)
        except PoolError as error:
            yield meta.root / name, str(error)
            continue
        if not path.is_file():
            yield path, f"The file '{path}' is missing."
        elif sha256_of(path) != told:
            yield (
                path,
                f"The file '{path}' is damaged: its check sum is not the one of the manifest.",
            )


def _other_writer(meta: Metadata) -> Iterator[str]:
    """Whether another tool has removed features, and so written the logs anew."""
    written = meta.manifest.get("features")
    if isinstance(written, list) and set(map(str, written)) != set(meta.features):
        yield (
            "Features were added or removed after the pool was written; the check sums of its "
            "logs do not count."
        )


def _check_log(meta: Metadata, episode: Episode) -> Iterator[str]:
    """One demonstration's rows: all there, counted and timed as they should be."""
    rows = episode.log_rows()
    where = f"in the log '{rows.path}' of demonstration {episode.index}"
    if len(rows) != episode.length:
        yield (
            f"The log '{rows.path}' has {len(rows)} rows of demonstration {episode.index}, "
            f"which has {episode.length} frames."
        )
        return
    row, frames = episode.row, np.arange(episode.length)
    first, stop = row["dataset_from_index"], row["dataset_to_index"]
    if stop - first != episode.length:
        yield (
            f"Demonstration {episode.index} covers the frames {first} to {stop} of the pool but "
            f"has {episode.length} frames."
        )
    for name, start in (("frame_index", 0), ("index", first)):
        values = rows.numbered.get(name)
        if values is not None and not np.array_equal(values, frames + start):
            yield f"'{name}' does not count the frames from {start} {where}."
    rows.times(float(meta.fps))
    read_columns(rows.path, _numeric(meta))


def _numeric(meta: Metadata) -> tuple[str, ...]:
    return tuple(n for n, spec in meta.features.items() if spec["dtype"] not in NOT_NUMBERS)


def _check_labels(meta: Metadata, episode: Episode) -> Iterator[str]:
    yield from episode.check_labels()
    if not meta.manifest.get("sha256"):  # else the check sums tell
        yield from episode.check_identity()


def _check_videos(meta: Metadata, episode: Episode) -> Iterator[str]:
    for key in meta.videos:
        yield from sentences(partial(_check_video, meta, episode, key))


def _check_video(meta: Metadata, episode: Episode, key: str) -> Iterator[str]:
    """One video: as long as the metadata and the log say."""
    row, fps = episode.row, float(meta.fps)
    path = meta.video_path(row, key)
    video = probe(path)
    begin = float(row.get(f"videos/{key}/from_timestamp", 0.0))
    end = row.get(f"videos/{key}/to_timestamp")
    last = begin + episode.length / fps
    slack = FRAME / min(fps, video.fps)  # a camera may have a rate of its own
    if last - video.duration > slack:
        yield (
            f"The video '{path}' is shorter than the log: it has {round(video.duration * fps)} "
            f"frames but demonstration {episode.index} ends at frame {round(last * fps)}."
        )
        return
    told = video.duration if end is None else float(end)
    if told - last > (slack if end is None else FRAME / fps):
        yield (
            f"The log of demonstration {episode.index} is shorter than its video '{path}': it ends "
            f"at frame {round(last * fps)} of {round(told * fps)}."
        )


def _too_long(meta: Metadata, episodes: Sequence[Episode]) -> Iterator[Problem]:
    """Does a video that holds one demonstration alone last longer than its log?

    It was recorded at another rate then, and frames found by time would not be those of the log.
    """
    for key in meta.videos:
        holders: dict[Path, list[Episode]] = {}
        for episode in episodes:
            holders.setdefault(meta.video_path(episode.row, key), []).append(episode)
        for path, (episode, *others) in holders.items():
            with contextlib.suppress(PoolError):  # told where each video is checked
                video, fps = probe(path), float(meta.fps)
                log = (
                    float(episode.row.get(f"videos/{key}/from_timestamp", 0)) + episode.length / fps
                )
                if not others and video.duration - log > FRAME / min(fps, video.fps):
                    yield Problem(
                        f"The log of demonstration {episode.index} is shorter than its video "
                        f"'{path}': it lasts {log:.1f} s of {video.duration:.1f} s.",
                        episode.index,
                    )


def _notes(meta: Metadata, episodes: Sequence[Episode]) -> Iterator[str]:
    """What is unusual about times and numbers, for all demonstrations together."""
    between = {episode.index for episode in episodes if _begins_between(meta, episode)}
    if between:
        yield (
            f"{_demonstrations(between)} between two frames of a video; the "
            "nearest frames are read, and LeRobot's own reader refuses them."
        )
    late: set[int] = set()
    missing: dict[str, set[int]] = {}
    for episode in episodes:
        try:
            late |= {episode.index} if _is_late(meta, episode) else set()
            for name in _not_finite(meta, episode):
                missing.setdefault(name, set()).add(episode.index)
        except PoolError:
            continue  # told as a problem
    if late:
        yield (
            f"The timestamps of {len(late)} demonstrations are not the frame numbers divided by "
            f"{meta.fps:g}, the first is demonstration {min(late)}; frames are read by time."
        )
    for name, where in missing.items():
        yield (
            f"'{name}' has values that are missing, not finite or of another size in "
            f"{len(where)} demonstrations, the first is demonstration {min(where)}; it cannot be "
            "learned from."
        )


def _demonstrations(indexes: set[int]) -> str:
    first = min(indexes)
    if len(indexes) == 1:
        return f"Demonstration {first} begins"
    return f"{len(indexes)} demonstrations, the first is demonstration {first}, begin"


def _begins_between(meta: Metadata, episode: Episode) -> bool:
    begins = [
        episode.row.get(f"videos/{key}/from_timestamp", 0.0) * meta.fps for key in meta.videos
    ]
    return any(abs(begin - round(begin)) > OFF_GRID for begin in begins)


def _is_late(meta: Metadata, episode: Episode) -> bool:
    rows = episode.log_rows()
    stamps = rows.numbered.get("timestamp")
    if stamps is None or not len(stamps):
        return False
    return bool(abs(stamps[0]) > TIME_TOLERANCE) or rows.times(float(meta.fps)) is not None


def _not_finite(meta: Metadata, episode: Episode) -> Iterator[str]:
    rows = episode.log_rows()
    table = read_columns(rows.path, _numeric(meta))
    return (name for name in table.column_names if not _is_finite(rows.select(table[name]), name))


def _is_finite(part: pa.ChunkedArray, name: str) -> bool:
    try:
        values = as_numpy(part, name)
    except PoolError:
        return False
    return values.dtype.kind != "f" or bool(np.isfinite(values).all())
