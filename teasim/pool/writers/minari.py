"""A Minari data set (HDF5): observations with pictures, actions between them, labels as infos."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from teasim.common.errors import ConfigError
from teasim.common.files import write_json
from teasim.pool.hdf5.logs import FILLED
from teasim.pool.readers.minari import MAIN, METADATA, RATE
from teasim.pool.types import index_from_spans
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
from teasim.pool.writers.pictures import require_one_size, safe_names
from teasim.pool.writers.writer import Writer

VERSION = "0.5.4"
"""Version of Minari whose form this is."""
REWARD, SUCCESS = "next.reward", "next.success"


def check(content: Content) -> None:
    """Refuse a demonstration without a step, and cameras whose pictures differ in size.

    Raises:
        ConfigError: there is one.
    """
    for item in content.items:
        if item.demo.length < 2:
            raise ConfigError(f"'{item.demo.name}' has one frame; a Minari episode needs two.")
    require_one_size(content)


def stage(content: Content, item: Item, folder: Path) -> None:
    """Write one demonstration of n frames: n observations and the n - 1 steps between them.

    The infos hold what belongs to all n frames: the whole logs and the sub-task of each frame.

    Raises:
        OSError: the file cannot be written.
        PoolError: the source is damaged.
    """
    n_steps = item.demo.length - 1
    with created(folder / STAGED) as file:
        demo = file.create_group("demo")
        demo.attrs["id"] = item.number
        demo.attrs["total_steps"] = n_steps
        write_facts(demo, item)
        write_pictures(demo.create_group("observations"), item, _cameras(content))
        for name, key in observations(content).items():
            path = key.replace(".", "/")
            write_log(demo["observations"], path, item.demo.log(name), content.logs[name])
        infos = demo.create_group("infos")
        for name in content.logs:
            if not name.startswith("observation."):
                write_log(infos, name, item.demo.log(name), content.logs[name])
        demo["actions"] = item.demo.log("action")[:n_steps]
        _write_outcome(demo, content, item)
        if content.subtasks:
            labels = index_from_spans(item.spans, content.subtasks, n_steps + 1)
            infos["subtask_index"] = labels
            demo.attrs["subtasks"] = json.dumps(list(content.subtasks), ensure_ascii=False)


def assemble(content: Content, folders: Sequence[Path], out: Path) -> list[str]:
    """Make a data set of the staged demonstrations."""
    (out / "data").mkdir(parents=True)
    with created(out / "data" / MAIN) as file:
        gather(folders, file, "episode")
        first = file["episode_0"]
        spaces = {
            "observation_space": _space(first["observations"]),
            "action_space": _space(first["actions"]),
        }
    lengths = [item.demo.length for item in content.items]
    name = content.root.stem
    write_json(
        out / "data" / METADATA,
        {
            "total_episodes": len(lengths),
            "total_steps": sum(lengths) - len(lengths),
            "data_format": "hdf5",
            "jpeg_encoding": False,
            **{key: json.dumps(space) for key, space in spaces.items()},
            "dataset_id": f"{next(iter(safe_names([name]).values()))}-v0",
            "minari_version": VERSION,
            "requirements": [],
            RATE: content.fps,
        },
    )
    return []


def _cameras(content: Content) -> dict[str, str]:
    """Return the path of each camera; one that a log has already gets the ending _image."""
    taken = set(observations(content).values())
    names = safe_names(content.cameras).items()
    paths = {camera: f"{name}_image" if name in taken else name for camera, name in names}
    return {camera: path.replace(".", "/") for camera, path in paths.items()}


def _write_outcome(demo: Any, content: Content, item: Item) -> None:
    """Write rewards and how the demonstration ended: with success, or cut off."""
    n_steps = item.demo.length - 1
    rewards = np.zeros(n_steps)
    if REWARD in content.logs:
        earned = item.demo.log(REWARD)[:, 0].astype(np.float64)
        rewards = earned[:n_steps]
        rewards[-1] += earned[-1]  # no step follows the last frame; the sum stays what it was
    demo["rewards"] = rewards
    demo["rewards"].attrs[FILLED] = REWARD not in content.logs
    done = bool(item.demo.log(SUCCESS)[-1, 0]) if SUCCESS in content.logs else False
    last = np.arange(n_steps) == n_steps - 1
    demo["terminations"], demo["truncations"] = last & done, last & (not done)


def _space(node: Any) -> dict[str, Any]:
    """Return the Gymnasium space of a group or array as Minari writes it."""
    if hasattr(node, "items"):
        return {"type": "Dict", "subspaces": {name: _space(child) for name, child in node.items()}}
    shape = node.shape[1:]
    picture = node.dtype == np.uint8
    low, high = (0, 255) if picture else (-np.inf, np.inf)
    bounds = {
        name: np.full(shape, bound).tolist() for name, bound in (("low", low), ("high", high))
    }
    return {"type": "Box", "dtype": str(node.dtype), "shape": list(shape), **bounds}


WRITER = Writer("minari", "Minari data set", stage, assemble, check=check, logs=("action",))
