"""What the HDF5 formats have in common: files of one demonstration, and how they are made."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from teasim.pool.clips.hdf5 import library
from teasim.pool.hdf5.facts import ATTRIBUTE, Facts
from teasim.pool.hdf5.logs import NAMES
from teasim.pool.writers.content import Content, Item

STAGED = "demo.hdf5"
"""Name of the file of one demonstration."""


@contextmanager
def created(path: Path, mode: str = "x") -> Iterator[Any]:
    """Make an HDF5 file; the same content gives the same bytes.

    Yields:
        `h5py.File`.

    Raises:
        OSError: it cannot be written.
        PoolError: h5py is not installed.
    """
    h5py = library(path)
    try:
        with h5py.File(path, mode) as file:
            yield file
    except RuntimeError as error:  # what h5py raises when a full disk shows as a file is closed
        raise OSError(None, str(error), str(path)) from error


def write_pictures(parent: Any, item: Item, cameras: dict[str, str]) -> None:
    """Write all pictures of a demonstration, losslessly compressed, picture by picture.

    Args:
        parent: group of the arrays.
        item: the demonstration.
        cameras: path of the array of each camera.
    """
    for camera, name in cameras.items():
        clip, data = item.demo.clip(camera), None
        for place, image in enumerate(clip.stream(np.arange(clip.length))):
            if data is None:
                shape = (clip.length, *image.shape)
                data = parent.create_dataset(
                    name, shape, np.uint8, chunks=(1, *image.shape), compression="gzip"
                )
            data[place] = image


def write_log(parent: Any, name: str, values: np.ndarray, names: Sequence[str]) -> None:
    """Write a log (n, D), or as (n,) if it has one dimension, with the names of its dimensions."""
    data = parent.create_dataset(name, data=values[:, 0] if values.shape[1] == 1 else values)
    data.attrs[NAMES] = json.dumps(list(names), ensure_ascii=False)


def write_facts(group: Any, item: Item) -> None:
    """Write what the format has no place for, and what a filter said, as attributes."""
    demo = item.demo
    facts = Facts(demo.demo_id, demo.task, item.spans, demo.record)
    group.attrs[ATTRIBUTE] = facts.text()
    if item.verdict is not None:
        for name in ("weight", "loss", "flagged", "group", "reason"):
            group.attrs[f"teasim_{name}"] = getattr(item.verdict, name)


def gather(folders: Sequence[Path], parent: Any, prefix: str) -> None:
    """Copy the demonstrations of staged files into one, as PREFIX_0, PREFIX_1, ..."""
    for number, folder in enumerate(folders):
        with library(folder).File(folder / STAGED, "r") as file:
            file.copy(file["demo"], parent, name=f"{prefix}_{number}")


def observations(content: Content) -> dict[str, str]:
    """Return the key below the observations of each log that is one."""
    prefix = "observation."
    return {name: name.removeprefix(prefix) for name in content.logs if name.startswith(prefix)}
