"""Minari data sets with the HDF5 back end; pictures anywhere in the observations, JPEG or plain."""

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from teasim.common.errors import ConfigError, PoolError
from teasim.pool.clips.hdf5 import library, opened
from teasim.pool.hdf5.facts import read_facts
from teasim.pool.hdf5.guard import require_readable
from teasim.pool.hdf5.logs import StoredLog, logs_of, observation_logs
from teasim.pool.hdf5.pictures import arrays, clips_in, group, logs_hash
from teasim.pool.readers.reader import Reader, ReadOptions
from teasim.pool.recordings import RecordedSource, Recording, unreadable

RATE = "teasim_fps"
"""Entry of metadata.json of data sets that teasim writes; Minari stores no frame rate."""
MAIN, METADATA = "main_data.hdf5", "metadata.json"
EPISODE = re.compile(r"episode_(\d{1,9})")
NAME = re.compile(r"([\w\-.]+/)*[\w\-.]+-v\d+")
"""A data set id: [namespace/]name-vN."""
DEFAULT_FPS = 20.0
"""Frames per second where none are given [1/s]; Minari stores none."""


def find(name: str) -> Path | None:
    """Return the folder of a data set id below $MINARI_DATASETS_PATH or ~/.minari/datasets."""
    if not NAME.fullmatch(name):
        return None
    home = os.environ.get("MINARI_DATASETS_PATH")
    place = (Path(home) if home else Path.home() / ".minari" / "datasets") / name
    return place if recognises(place) else None


def recognises(path: Path) -> bool:
    """Tell whether `path` is a data set's folder, its folder data, or its main file."""
    return (
        path.name == MAIN
        or any((path / part / MAIN).is_file() for part in ("data", "."))
        or (_is_arrow(path / "data") or _is_arrow(path))
    )


def open_folder(path: Path, options: ReadOptions) -> RecordedSource:
    """Open the data set.

    Raises:
        PoolError: it is damaged, stored as arrow files, or has no pictures.
    """
    folder = path.parent if path.name == MAIN else path
    folder = folder / "data" if (folder / "data").is_dir() else folder
    if not (folder / MAIN).is_file():
        raise PoolError(
            f"The Minari data set '{path}' is stored as arrow files; only hdf5 is read: write it "
            "again with data_format='hdf5'."
        )
    place = folder / MAIN
    library(place)
    require_readable([place])
    with opened(place) as file:
        names = sorted(filter(EPISODE.fullmatch, file), key=lambda name: int(name[8:]))
        if not names:
            raise PoolError(f"'{place}' has no groups episode_*, as a Minari data set has.")
        episodes = [_recording(place, name, file[name]) for name in names]
    common = set.intersection(*(set(episode.clips) for episode in episodes))
    if not common:
        raise PoolError(
            f"'{place}' has no pictures that all episodes have, only "
            f"{', '.join(_low_dimensional(place, names[0]))}; record them in the observations."
        )
    stored = _stored_rate(folder)
    if stored is not None and options.fps is not None:
        raise ConfigError(f"'{path}' stores its own frame rate, {stored:g}; leave out fps.")
    fps = stored or options.fps
    notes = (
        ()
        if fps
        else (
            f"A Minari data set does not store its frame rate; {DEFAULT_FPS:g} Hz is assumed, "
            "set --fps to change it.",
        )
    )
    return RecordedSource(
        path,
        fps or DEFAULT_FPS,
        tuple(sorted(common)),
        tuple(episodes),
        _usage,
        tuple(dict.fromkeys(span.subtask for demo in episodes for span in demo.labels)),
        notes=notes,
    )


def _recording(path: Path, name: str, episode: Any) -> Recording:
    observations = episode.get("observations")
    if observations is None:
        raise PoolError(f"'{path}' is damaged: '{name}' has no observations.")
    clips = clips_in(path, observations)
    lengths = {clip.length for clip in clips.values()}
    if len(lengths) > 1:
        raise PoolError(f"'{path}' is damaged: the cameras of '{name}' differ in length.")
    logs = {key: data for key, data in arrays(episode) if key.startswith(("act", "obs"))}
    number = str(episode.attrs.get("id", name[8:]))
    length = lengths.pop() if lengths else 0
    facts = read_facts(episode, length)
    return Recording(
        index=int(name[8:]),
        name=name,
        length=length,
        clips=clips,
        entry=number,
        content=logs_hash(path, logs),
        labels=facts.spans if facts else (),
        task=facts.task if facts else "",
        record=facts.record if facts else None,
        logs=_logs(path, episode, length),
        identity=facts.demo_id if facts else "",
    )


def _logs(path: Path, episode: Any, length: int) -> dict[str, StoredLog]:
    """Return actions, rewards and low-dimensional observations.

    Minari has no action after the last observation; teasim writes the whole log into the infos.
    """
    infos = group(episode, "infos")
    named = {
        "action": infos.get("action", episode.get("actions")),
        "next.reward": infos.get("next.reward", episode.get("rewards")),
        "next.success": infos.get("next.success"),
    }
    logs = observation_logs(path, episode["observations"], length)
    return logs | logs_of(
        path, {name: data for name, data in named.items() if hasattr(data, "shape")}, length
    )


def _low_dimensional(path: Path, name: str) -> list[str]:
    with opened(path) as file:
        return [key for key, _ in arrays(group(file, name))][:5]


def _stored_rate(folder: Path) -> float | None:
    """Return the frames per second that teasim writes into metadata.json; None without."""
    try:
        rate = json.loads((folder / METADATA).read_text(encoding="utf-8")).get(RATE)
    except (OSError, ValueError, AttributeError):
        return None
    return float(rate) if isinstance(rate, int | float) and 0 < rate < 1e6 else None


def _is_arrow(folder: Path) -> bool:
    try:
        told = json.loads((folder / METADATA).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return False
    return isinstance(told, dict) and told.get("data_format") == "arrow"


def _usage(root: Path, entries: Sequence[str], keep: bool) -> list[str]:
    del root
    word = "in" if keep else "not in"
    numbers = ", ".join(entries)
    return [f"Minari:    dataset.filter_episodes(lambda episode: episode.id {word} [{numbers}])"]


def check(path: Path) -> list[str]:
    """Decode every picture and return a sentence for each damage."""
    return unreadable(lambda: open_folder(path, ReadOptions()))


READER = Reader("Minari data set", recognises, open_folder, check, options=("fps",), find=find)
