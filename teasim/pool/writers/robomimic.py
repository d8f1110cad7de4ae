"""robomimic's HDF5 file, with MimicGen's sub-task signals and masks of what a filter kept."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from teasim.pool.hdf5.logs import FILLED, NAMES
from teasim.pool.readers.robomimic import ACTION_OFFSET, ACTION_SCALE
from teasim.pool.writers.content import Content, Item
from teasim.pool.writers.hdf5 import (
    STAGED,
    created,
    gather,
    observations,
    write_facts,
    write_log,
    write_pictures,
)
from teasim.pool.writers.pictures import safe_names
from teasim.pool.writers.writer import Writer

GYM = 2
"""robomimic's number of environments made with gym."""
REWARD = "next.reward"


def stage(content: Content, item: Item, folder: Path) -> None:
    """Write one demonstration, its actions as they were commanded.

    Raises:
        OSError: the file cannot be written.
        PoolError: the source is damaged.
    """
    length = item.demo.length
    with created(folder / STAGED) as file:
        demo = file.create_group("demo")
        demo.attrs["num_samples"] = length
        demo.attrs["ep_meta"] = json.dumps({"lang": item.demo.task}, ensure_ascii=False)
        write_facts(demo, item)
        write_pictures(demo.create_group("obs"), item, _cameras(content))
        for name, key in observations(content).items():
            write_log(demo["obs"], key, item.demo.log(name), content.logs[name])
        demo["actions"] = item.demo.log("action").astype(np.float64)
        demo["actions"].attrs[NAMES] = json.dumps(list(content.logs["action"]))
        rewards = item.demo.log(REWARD)[:, 0] if REWARD in content.logs else np.zeros(length)
        demo["rewards"] = rewards
        if REWARD not in content.logs:
            demo["rewards"].attrs[FILLED] = True
        demo["dones"] = (np.arange(length) == length - 1).astype(np.int64)
        _write_signals(demo, content, item)


def assemble(content: Content, folders: Sequence[Path], out: Path) -> list[str]:
    """Make one file of the staged demonstrations, with actions in [-1, 1]."""
    with created(out) as file:
        data = file.create_group("data")
        gather(folders, data, "demo")
        demos = [data[f"demo_{number}"] for number in range(len(folders))]
        scale, offset = _scaling([demo["actions"][()] for demo in demos])
        for demo in demos:
            normal = np.clip((demo["actions"][()] - offset) / scale, -1.0, 1.0)
            demo["actions"][...] = normal
        scaled = {ACTION_SCALE: scale.tolist(), ACTION_OFFSET: offset.tolist()}
        env = {
            "env_name": content.root.stem,
            "type": GYM,
            "env_kwargs": {"control_freq": content.fps, **scaled},
        }
        data.attrs["total"] = sum(item.demo.length for item in content.items)
        data.attrs["env_args"] = json.dumps(env)
        for name, values in scaled.items():
            data.attrs[name] = values
        for name, members in _masks(content).items():
            file[f"mask/{name}"] = np.array(members, dtype="S")
    if (scale == 1.0).all() and (offset == 0.0).all():
        return []
    return [
        "Actions lie in [-1, 1] as robomimic needs it: action = stored * action_scale + "
        "action_offset, both in env_args and as attributes of data."
    ]


def _scaling(actions: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Return scale and offset, (A,) each, that map all actions (n, A) to [-1, 1]."""
    low = np.min([values.min(axis=0) for values in actions], axis=0)
    high = np.max([values.max(axis=0) for values in actions], axis=0)
    if (low >= -1).all() and (high <= 1).all():
        return np.ones_like(low), np.zeros_like(low)
    half = (high - low) / 2
    return np.where(half > 0, half, 1.0), (high + low) / 2


def _cameras(content: Content) -> dict[str, str]:
    """Return the key of each camera; one that a log has already gets the ending _image."""
    taken = set(observations(content).values())
    names = safe_names(content.cameras).items()
    return {camera: f"{name}_image" if name in taken else name for camera, name in names}


def _write_signals(demo: Any, content: Content, item: Item) -> None:
    """Write MimicGen's signals: 1 from the last frame of a sub-task's last span on."""
    ends = {span.subtask: span.stop - 1 for span in item.spans}
    for name, key in safe_names(content.subtasks).items():
        if name in ends:
            on = np.arange(item.demo.length) >= ends[name]
            demo[f"datagen_info/subtask_term_signals/{key}"] = on.astype(np.int64)


def _masks(content: Content) -> dict[str, list[str]]:
    """Return the names of the demonstrations in each mask; empty masks are left out."""
    masks: dict[str, list[str]] = {}
    for item in content.items:
        if item.verdict is not None:
            for mask in ("flagged" if item.verdict.flagged else "keep", _group(item)):
                masks.setdefault(mask, []).append(f"demo_{item.number}")
    return masks


def _group(item: Item) -> str:
    return f"group_{item.verdict.group if item.verdict else 0}"


WRITER = Writer(
    "robomimic",
    "robomimic file",
    stage,
    assemble,
    suffixes=(".hdf5", ".h5"),
    logs=("action",),
)
