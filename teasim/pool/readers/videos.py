"""Folders of video files: one file is one demonstration.

FOLDER/ep1.mp4                        one camera
FOLDER/left/ep1.mp4, right/ep1.mp4    a folder per camera; the same name is the same demonstration
"""

import re
import shlex
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from teasim.common.errors import PoolError
from teasim.pool.clips import VideoClip, VideoInfo, probe
from teasim.pool.readers.reader import Reader, ReadOptions
from teasim.pool.readers.video_labels import (
    LABELS,
    DemoRow,
    is_table,
    read_demonstrations,
    read_labels,
)
from teasim.pool.recordings import RecordedSource, Recording, listed, unreadable
from teasim.pool.types import Span

SUFFIXES = frozenset(
    [
        *(".3gp", ".asf", ".avi", ".divx", ".f4v", ".flv", ".m2ts", ".m4v", ".mkv", ".mov"),
        *(".mp4", ".mpeg", ".mpg", ".mts", ".mxf", ".ogv", ".ts", ".vob", ".webm", ".wmv"),
    ]
)
"""Endings of video files with time stamps that ffmpeg reads, in lower case."""
CAMERA = "video"
"""Name of the only camera of a flat folder."""
SAME_RATE = 0.01
"""Rates that differ by less than this share are one: short files round their time stamps."""
SHOWN = 3
"""Most names in a sentence."""


def is_video(path: Path) -> bool:
    """Tell whether the name of a file says that it is a video."""
    return path.suffix.lower() in SUFFIXES and path.is_file()


def recognises(path: Path) -> bool:
    """Tell whether `path` is a video, or a folder with videos or with folders of videos."""
    if not path.is_dir():
        return is_video(path)
    return any(is_video(file) for folder in (path, *_folders(path)) for file in listed(folder))


def open_folder(path: Path, options: ReadOptions) -> RecordedSource:
    """List the demonstrations in order of their names, numbers in them as numbers.

    Raises:
        PoolError: it is a single video, a video is damaged, or a camera lacks a demonstration.
    """
    del options  # videos store everything
    if path.is_file():
        raise PoolError(
            f"'{path}' is a single video; a source is a folder with one video per demonstration."
        )
    cameras = _cameras(path)
    names = sorted({name for files in cameras.values() for name in files}, key=natural)
    _check_complete(path, cameras, names)
    infos = {file: probe(file) for files in cameras.values() for file in files.values()}
    fps = _usual_rate([info.fps for info in infos.values()])
    episodes, notes = [], []
    known, labels = read_demonstrations(path), read_labels(path)
    for index, name in enumerate(names):
        files = {camera: cameras[camera][name] for camera in cameras}
        clips = _clips({camera: (file, infos[file]) for camera, file in files.items()}, fps)
        entry = next(iter(files.values())).name if len(cameras) == 1 else name
        length = next(iter(clips.values())).length
        told = known.get(name, DemoRow(name, "", ""))
        spans = _spans(path, name, labels.get(name, ()), length)
        demo = Recording(index, name, length, clips, entry, labels=spans, task=told.task)
        episodes.append(replace(demo, identity=told.demo_id))
        uneven = {infos[file].n_frames for file in files.values()}
        if len(uneven) > 1 and all(_same(infos[file].fps, fps) for file in files.values()):
            notes.append(
                f"The cameras show '{name}' for {_listed(sorted(uneven))} frames; the "
                f"first {length} are used."
            )
    return RecordedSource(
        path,
        fps,
        tuple(cameras),
        tuple(episodes),
        _usage,
        tuple(dict.fromkeys(span.subtask for demo in episodes for span in demo.labels)),
        notes=(*_notes(path, cameras, infos, fps), *notes),
    )


def _spans(root: Path, name: str, spans: Sequence[Span], length: int) -> tuple[Span, ...]:
    """Return the labelled sub-tasks of a video.

    Raises:
        PoolError: they overlap, or end after the video.
    """
    ends = [0, *(span.stop for span in spans)]
    late = any(span.start < before for before, span in zip(ends, spans, strict=False))
    if late or ends[-1] > length:
        raise PoolError(
            f"The sub-tasks of '{name}' in '{root / LABELS}' overlap or end after its {length} "
            "frames."
        )
    return tuple(spans)


def natural(name: str) -> tuple[object, ...]:
    """Return a key that sorts ep2 before ep10."""
    parts = re.split(r"(\d+)", name.casefold())
    numbered = tuple((int(part), "") if part.isdecimal() else (-1, part) for part in parts)
    return (*numbered, (-1, name))


def _cameras(root: Path) -> dict[str, dict[str, Path]]:
    """Return by camera the file of each demonstration."""
    flat = _videos(root)
    nested = {folder.name: _videos(folder) for folder in _folders(root)}
    nested = {name: files for name, files in nested.items() if files}
    if flat and nested:
        raise PoolError(
            f"'{root}' holds both videos and folders of videos ({_listed(nested)}); a source is "
            "one of these, name it or move the others away."
        )
    if flat:
        return {CAMERA: flat}
    shown = max(len(files) for files in nested.values())
    if len(nested) > shown and not read_demonstrations(root):
        raise PoolError(
            f"'{root}' has {len(nested)} folders of at most {shown} videos; sort them into one "
            "folder per camera, CAMERA/DEMONSTRATION.mp4."
        )
    return nested


def _videos(folder: Path) -> dict[str, Path]:
    found: dict[str, Path] = {}
    for file in filter(is_video, listed(folder)):
        other = found.setdefault(file.stem, file)
        if other != file:
            raise PoolError(
                f"'{other}' and '{file.name}' have the same name; rename or remove one of them."
            )
    return found


def _folders(root: Path) -> list[Path]:
    return sorted(filter(Path.is_dir, listed(root)), key=lambda path: natural(path.name))


def _check_complete(
    root: Path, cameras: Mapping[str, Mapping[str, Path]], names: Sequence[str]
) -> None:
    for camera, files in cameras.items():
        missing = [name for name in names if name not in files]
        if missing:
            other = max(cameras, key=lambda name: len(cameras[name]))
            raise PoolError(
                f"The camera '{camera}' of '{root}' has no video of {_listed(missing)}; add "
                "what is missing, move the others away, or open one camera alone: "
                f"'{root / other}'."
            )


def _usual_rate(rates: Sequence[float]) -> float:
    """Return the rate that most files have [1/s], of equally frequent ones the lowest."""
    frequent = max(sorted(rates), key=lambda rate: sum(_same(rate, other) for other in rates))
    return round(frequent, 3)


def _same(rate: float, other: float) -> bool:
    return abs(rate / other - 1) < SAME_RATE


def _clips(files: Mapping[str, tuple[Path, VideoInfo]], fps: float) -> dict[str, VideoClip]:
    """Return clips of one length: frame by frame at the usual rate, or else matched by time."""
    if all(_same(info.fps, fps) for _, info in files.values()):
        length = min(info.n_frames for _, info in files.values())
        return {
            camera: VideoClip(path, 0.0, length, fps, info.times[:length])
            for camera, (path, info) in files.items()
        }
    # A quarter of a frame is within what rounded time stamps may lack at the end.
    last = min(info.times[-1] for _, info in files.values())
    length = int(last * fps + 0.25) + 1
    return {camera: VideoClip(path, 0.0, length, fps) for camera, (path, _) in files.items()}


def _notes(
    root: Path,
    cameras: Mapping[str, Mapping[str, Path]],
    infos: Mapping[Path, VideoInfo],
    fps: float,
) -> list[str]:
    notes = []
    if len(cameras) > 1:
        notes.append(f"Each folder of '{root}' is a camera: {', '.join(cameras)}.")
    others = Counter(f"{i.fps:.4g}" for i in infos.values() if not _same(i.fps, fps))
    if others:
        notes.append(
            f"Not all videos of '{root}' have the same rate: {sum(others.values())} of "
            f"{len(infos)} are at {', '.join(others)} Hz and are read at {fps:g} Hz."
        )
    places = [root, *(_folders(root) if len(cameras) > 1 or CAMERA not in cameras else ())]
    ignored = sorted(
        str(file.relative_to(root))
        for place in places
        for file in listed(place)
        if file.is_file() and not is_video(file) and not is_table(file)
    )
    if ignored:
        notes.append(f"Files of '{root}' that are no videos are left out: {_listed(ignored)}.")
    return notes


def _listed(names: Iterable[object]) -> str:
    listed = [str(name) for name in names]
    more = len(listed) - SHOWN
    return ", ".join(listed[:SHOWN]) + (f" and {more} more" if more > 0 else "")


def _usage(root: Path, entries: Sequence[str], keep: bool) -> list[str]:
    """Return the line that copies what a list names; it serves both lists."""
    del entries
    listed = "keep.txt" if keep else "exclude.txt"
    from_to = f"{shlex.quote(f'{root}/')} {shlex.quote(f'{root}_{listed[:-4]}/')}"
    if _videos(root):
        return [f"Videos:    grep -v '^#' {listed} | rsync -a --files-from=- {from_to}"]
    return [
        f"Videos:    sed '/^#/d; s|.*|/*/&.*|' {listed} | "
        f"rsync -a --include='*/' --include-from=- --exclude='*' {from_to}"
    ]


def check(path: Path) -> list[str]:
    """Decode every picture and return a sentence for each damage."""
    return unreadable(lambda: open_folder(path, ReadOptions()))


READER = Reader("folder of videos", recognises, open_folder, check, options=())
