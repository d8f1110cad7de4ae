"""Folders of ALOHA and ACT: an HDF5 file per episode, pictures in observations/images/CAMERA."""

from collections.abc import Sequence
from pathlib import Path

from teasim.common.errors import PoolError
from teasim.pool.clips.hdf5 import opened
from teasim.pool.hdf5.guard import require_readable
from teasim.pool.hdf5.logs import logs_of
from teasim.pool.hdf5.pictures import arrays, clips_in, files_in, group, logs_hash, root_names
from teasim.pool.readers.reader import Reader, ReadOptions
from teasim.pool.readers.videos import natural
from teasim.pool.recordings import RecordedSource, Recording, unreadable

DEFAULT_FPS = 50.0
"""ALOHA's control frequency [1/s] (Zhao et al. 2023, DT = 0.02 s); the files do not store it."""


def recognises(path: Path) -> bool:
    """Tell whether `path` is such a file, or a folder whose first readable HDF5 file is one."""
    for file in files_in(path):
        names = root_names(file)
        if names:
            return "observations" in names and "data" not in names
    return False


def open_folder(path: Path, options: ReadOptions) -> RecordedSource:
    """List the episodes in order of their file names.

    Raises:
        PoolError: it is a single episode, an episode is damaged, or there are no pictures.
    """
    if path.is_file():
        raise PoolError(
            f"'{path}' is a single ALOHA episode; a source is a folder with one file per episode."
        )
    files = sorted(files_in(path), key=lambda file: natural(file.name))
    require_readable(files)
    episodes = [_recording(index, file) for index, file in enumerate(files)]
    common = set.intersection(*(set(episode.clips) for episode in episodes))
    if not common:
        raise PoolError(f"The episodes of '{path}' have no camera in common.")
    notes = (
        ()
        if options.fps
        else (
            f"ALOHA episodes do not store their frame rate; {DEFAULT_FPS:g} Hz is assumed, "
            "set --fps to change it.",
        )
    )
    fps = options.fps or DEFAULT_FPS
    return RecordedSource(path, fps, tuple(sorted(common)), tuple(episodes), _usage, notes=notes)


def _recording(index: int, path: Path) -> Recording:
    with opened(path) as file:
        observations = group(file, "observations")
        clips = clips_in(path, group(observations, "images"))
        lengths = {clip.length for clip in clips.values()}
        if len(lengths) != 1:
            raise PoolError(
                f"'{path}' has no pictures of one length in observations/images, as an ALOHA "
                "episode has."
            )
        logs = {key: data for key, data in arrays(file) if not key.startswith("observations/im")}
        content = logs_hash(path, logs)
        length = lengths.pop()
        named = {_log_name(key): data for key, data in logs.items()}
        stored = logs_of(path, named, length)
    return Recording(index, path.stem, length, clips, path.name, content, logs=stored)


def _log_name(key: str) -> str:
    """Return LeRobot's name of an array: qpos is the state."""
    return {"action": "action", "observations/qpos": "observation.state"}.get(
        key, f"observation.{key.removeprefix('observations/').replace('/', '.')}"
    )


def _usage(root: Path, entries: Sequence[str], keep: bool) -> list[str]:
    word = "keep only" if keep else "leave out"
    return [f"ALOHA:     {word} these files of '{root}': {' '.join(entries)}"]


def check(path: Path) -> list[str]:
    """Decode every picture and return a sentence for each damage."""
    return unreadable(lambda: open_folder(path, ReadOptions()))


READER = Reader("folder of ALOHA episodes", recognises, open_folder, check, options=("fps",))
