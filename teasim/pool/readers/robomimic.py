"""robomimic's HDF5 files, also of MimicGen and LIBERO: groups data/demo_N, pictures in obs/*."""

import json
import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from teasim.common.errors import ConfigError, PoolError
from teasim.pool.clips.hdf5 import library, opened
from teasim.pool.hdf5.facts import read_facts
from teasim.pool.hdf5.guard import require_readable
from teasim.pool.hdf5.logs import StoredLog, logs_of, observation_logs
from teasim.pool.hdf5.pictures import arrays, clips_in, files_in, group, logs_hash
from teasim.pool.readers import aloha, minari
from teasim.pool.readers.reader import Reader, ReadOptions
from teasim.pool.recordings import RecordedSource, Recording, unreadable
from teasim.pool.source import Clip
from teasim.pool.types import Span

DEMO = re.compile(r"demo_(\d{1,9})")
DEFAULT_FPS = 20.0
"""robosuite's usual control frequency [1/s], for files that do not store theirs."""
ACTION_SCALE, ACTION_OFFSET = "action_scale", "action_offset"
"""Entries of env_kwargs of files that teasim writes: action = stored * scale + offset."""


def recognises(path: Path) -> bool:
    """Tell whether `path` is an HDF5 file, or a folder of some, of no other known form."""
    others = minari.recognises(path) or aloha.recognises(path)
    return bool(files_in(path)) and not others


def open_file(path: Path, options: ReadOptions) -> RecordedSource:
    """Open the file, or the only one of a folder.

    Raises:
        ConfigError: there is no such mask, or a frame rate was given that the file stores itself.
        PoolError: it is damaged, or has no pictures.
    """
    files = files_in(path)
    library(files[0])  # without it an ALOHA folder is taken for one of robomimic files
    if len(files) > 1:
        known = ", ".join(file.name for file in files)
        raise PoolError(f"'{path}' holds {len(files)} HDF5 files, {known}; name one of them.")
    require_readable(files)
    (place,) = files
    with opened(place) as file:
        data = group(file, "data")
        names = sorted((name for name in data if DEMO.fullmatch(name)), key=_number)
        if not names:
            raise PoolError(
                f"'{place}' has no groups data/demo_*, as a robomimic file has; its root holds "
                f"{', '.join(sorted(file)) or 'nothing'}."
            )
        notes = _mask_notes(place, file)
        names = names if options.mask is None else _masked(place, file, options.mask, names)
        fps, told = _rate(place, data, options)
        cameras, clips, left_out = _cameras(place, data, names)
        kept = [name for name in names if clips[name]]
        task = _text(data, "problem_info", "language_instruction")
        found = [_recording(place, data[n], {c: clips[n][c] for c in cameras}, task) for n in kept]
    subtasks = sorted({span.subtask for demo in found for span in demo.labels})
    return RecordedSource(
        place, fps, cameras, tuple(found), _usage, tuple(subtasks), (*told, *notes, *left_out)
    )


def term_spans(signals: dict[str, np.ndarray], length: int) -> tuple[Span, ...]:
    """Return the sub-tasks that signals tell to be finished.

    MimicGen's rule: a sub-task ends with the frame at which its signal, (length,) of 0 and 1,
    first is 1, and the next one begins there. Frames after the last one belong to none.
    """
    first = {name: int(np.argmax(on > 0)) + 1 for name, on in signals.items() if (on > 0).any()}
    ends = sorted((stop, name) for name, stop in first.items())
    stops = [stop for stop, _ in ends]
    for place in range(len(stops) - 2, -1, -1):  # of several that end at once each gets a frame
        stops[place] = min(stops[place], stops[place + 1] - 1)
    spans, start = [], 0
    for (_, name), stop in zip(ends, stops, strict=True):
        if start < stop <= length:
            spans.append(Span(name, start, stop))
            start = stop
    return tuple(spans)


def _number(name: str) -> int:
    return int(name.partition("_")[2])


def _recording(path: Path, demo: Any, clips: Mapping[str, Clip], task: str) -> Recording:
    name = demo.name.rpartition("/")[2]
    lengths = {clip.length for clip in clips.values()}
    actions = demo.get("actions")
    lengths |= set() if actions is None else {actions.shape[0]}
    if len(lengths) > 1:
        raise PoolError(
            f"'{path}' is damaged: the arrays of '{name}' have {_listed(sorted(lengths))} rows."
        )
    (length,) = lengths
    logs = {f"obs/{key}": data for key, data in arrays(group(demo, "obs"))}
    logs |= {} if actions is None else {"actions": actions}
    signals = group(group(demo, "datagen_info"), "subtask_term_signals")
    terms = {key: np.ravel(data[()]) for key, data in arrays(signals) if data.shape == (length,)}
    facts = read_facts(demo, length)
    return Recording(
        index=_number(name),
        name=name,
        length=length,
        clips=clips,
        entry=name,
        content=logs_hash(path, logs),
        labels=facts.spans if facts else term_spans(terms, length),
        task=_text(demo, "ep_meta", "lang") or (facts.task if facts else task),
        record=facts.record if facts else None,
        logs=_logs(path, demo, length),
        identity=facts.demo_id if facts else "",
    )


def _logs(path: Path, demo: Any, length: int) -> dict[str, StoredLog]:
    """Return the low-dimensional observations, the actions as they were commanded, the rewards."""
    named = {"action": demo.get("actions"), "next.reward": demo.get("rewards")}
    logs = observation_logs(path, group(demo, "obs"), length)
    logs |= logs_of(path, {name: data for name, data in named.items() if data is not None}, length)
    kwargs = _json(demo.parent, "env_args").get("env_kwargs")
    told = kwargs if isinstance(kwargs, dict) else {}
    scale, offset = (told.get(name) for name in (ACTION_SCALE, ACTION_OFFSET))
    if "action" in logs and isinstance(scale, list) and isinstance(offset, list):
        if not len(scale) == len(offset) == len(logs["action"].names):
            raise PoolError(f"'{path}' is damaged: its action_scale does not fit the actions.")
        logs["action"] = replace(logs["action"], scale=tuple(scale), offset=tuple(offset))
    return logs


def _cameras(
    path: Path, data: Any, names: Sequence[str]
) -> tuple[tuple[str, ...], Mapping[str, Mapping[str, Clip]], list[str]]:
    """Return the cameras that all demonstrations have, the clips of each, and notes."""
    clips = {name: clips_in(path, group(data[name], "obs")) for name in names}
    seen = [set(found) for found in clips.values() if found]
    if not seen:
        stored = sorted(group(data[names[0]], "obs")) or sorted(data[names[0]])
        raise PoolError(
            f"'{path}' has no pictures, only {_listed(stored)}; render them with robomimic's "
            "dataset_states_to_obs.py --camera_names NAME."
        )
    cameras = tuple(sorted(set.intersection(*seen)))
    if not cameras:
        raise PoolError(f"The demonstrations of '{path}' have no camera in common.")
    notes = []
    some = sorted(set.union(*seen) - set(cameras))
    if some:
        notes.append(f"Cameras that not all demonstrations have are left out: {_listed(some)}.")
    dark = [name for name in names if not clips[name]]
    if dark:
        notes.append(f"Demonstrations without pictures are left out: {_listed(dark)}.")
    return cameras, clips, notes


def _mask_notes(path: Path, file: Any) -> list[str]:
    masks = [
        f"{name} ({data.shape[0]})"
        for name, data in arrays(group(file, "mask"))
        if len(data.shape) == 1
    ]
    if not masks:
        return []
    return [f"'{path.name}' has masks, of which --mask NAME reads one: {', '.join(masks)}."]


def _masked(path: Path, file: Any, mask: str, names: Sequence[str]) -> list[str]:
    masks = dict(arrays(group(file, "mask")))
    if mask not in masks:
        known = ", ".join(masks) or "none"
        raise ConfigError(f"'{path}' has no mask '{mask}'; it has {known}.")
    wanted = {bytes(name).decode() for name in np.ravel(masks[mask][()]).astype("S")}
    for name in sorted(wanted - set(names)):
        raise PoolError(f"The mask '{mask}' of '{path}' names '{name}', which is not in the file.")
    if not wanted:
        raise PoolError(f"The mask '{mask}' of '{path}' is empty.")
    return [name for name in names if name in wanted]


def _rate(path: Path, data: Any, options: ReadOptions) -> tuple[float, list[str]]:
    """Return the frames per second, and a note when they are assumed."""
    kwargs = _json(data, "env_args").get("env_kwargs")
    stored = kwargs.get("control_freq") if isinstance(kwargs, dict) else None
    if isinstance(stored, int | float) and 0 < stored < 1e6:
        if options.fps is not None:
            raise ConfigError(f"'{path}' stores its own frame rate, {stored:g}; leave out fps.")
        return float(stored), []
    if options.fps is not None:
        return options.fps, []
    return DEFAULT_FPS, [
        f"'{path.name}' does not store its frame rate; {DEFAULT_FPS:g} Hz is assumed, set --fps to "
        "change it."
    ]


def _json(node: Any, attribute: str) -> dict[str, Any]:
    """Return a JSON object stored as an attribute; an empty one where there is none."""
    try:
        found = json.loads(node.attrs[attribute])
    except (KeyError, TypeError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _text(node: Any, attribute: str, key: str) -> str:
    found = _json(node, attribute).get(key)
    return found.strip() if isinstance(found, str) else ""


def _listed(names: Sequence[object]) -> str:
    return ", ".join(map(str, names[:5])) + ", ..." * (len(names) > 5)


def _usage(root: Path, entries: Sequence[str], keep: bool) -> list[str]:
    names = " ".join(entries)
    if not keep:
        return [f"robomimic: leave these names out of the mask you train on: {names}"]
    code = (
        f'import h5py; file = h5py.File({json.dumps(str(root))}, "a"); '
        f'file.pop("mask/keep", None); '
        f'file["mask/keep"] = [name.encode() for name in "{names}".split()]'
    )
    return [
        f"robomimic: python -c {shlex.quote(code)}   (writes the mask keep into the file)",
        "robomimic: train with train.hdf5_filter_key=keep",
    ]


def check(path: Path) -> list[str]:
    """Decode every picture and return a sentence for each damage."""
    return unreadable(lambda: open_file(path, ReadOptions()))


READER = Reader("robomimic file", recognises, open_file, check, options=("fps", "mask"))
