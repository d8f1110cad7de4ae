"""Logs of numbers in HDF5 files: arrays with a row per frame, read when they are asked for."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.clips.hdf5 import opened
from teasim.pool.hdf5.pictures import arrays, checked, is_pictures

WIDEST = 4096
"""Most dimensions of a log; wider arrays are maps or point clouds, not what a log records."""
NAMES, FILLED = "names", "filled"
"""Attributes of an array: names of its dimensions as JSON; whether it holds no measurement."""


@dataclass(frozen=True)
class StoredLog:
    """One log of one demonstration in an HDF5 file."""

    path: Path
    """The HDF5 file."""
    dataset: str
    """Path of the array in it, of `length` rows or one fewer."""
    length: int
    """Number of frames; where the array has one row fewer, its last row stands for two frames."""
    names: tuple[str, ...]
    """Names of the D dimensions."""
    scale: tuple[float, ...] | None = None
    """Factor per dimension that turns what is stored into the log; None for 1."""
    offset: tuple[float, ...] | None = None
    """What is added per dimension after that; None for 0."""

    def read(self) -> np.ndarray:
        """Return the log, (length, D) float32.

        Raises:
            PoolError: the file is missing or damaged, or a number is not finite.
        """
        with opened(self.path) as file:
            stored = np.asarray(checked(self.path, file[self.dataset])[()])
        values = stored.reshape(len(stored), -1)[: self.length]
        if self.scale is not None and self.offset is not None:
            values = values * np.array(self.scale) + np.array(self.offset)
        missing = self.length - len(values)
        values = np.pad(values.astype(np.float32), ((0, missing), (0, 0)), mode="edge")
        if not np.isfinite(values).all():
            frame = int(np.argwhere(~np.isfinite(values))[0][0])
            raise PoolError(
                f"'{self.dataset}' of '{self.path}' is not a finite number at frame {frame}."
            )
        return values


def stored_log(path: Path, data: Any, length: int, name: str) -> StoredLog | None:
    """Return an array as the log `name`; None if it is no log of `length` frames."""
    shape: tuple[int, ...] = data.shape or ()
    if data.dtype.kind not in "fiub" or len(shape) not in (1, 2) or is_pictures(data):
        return None
    width = int(shape[1]) if len(shape) == 2 else 1
    fits = shape[0] in (length, length - 1) and shape[0] > 0
    if not fits or not 0 < width <= WIDEST or data.attrs.get(FILLED):
        return None
    return StoredLog(path, data.name, length, _names(data, name, width))


def observation_logs(path: Path, parent: Any, length: int) -> dict[str, StoredLog]:
    """Return the logs in a group of observations by name; pictures are passed over."""
    if hasattr(parent, "shape"):
        return {}
    named = {f"observation.{key.replace('/', '.')}": data for key, data in arrays(parent)}
    return logs_of(path, named, length)


def logs_of(path: Path, named: Mapping[str, Any], length: int) -> dict[str, StoredLog]:
    """Return those arrays that are logs of `length` frames."""
    found = {name: stored_log(path, data, length, name) for name, data in named.items()}
    return {name: log for name, log in found.items() if log is not None}


def _names(data: Any, name: str, width: int) -> tuple[str, ...]:
    """Return the names beside the array, else NAME_0, NAME_1, ..."""
    try:
        told = json.loads(data.attrs[NAMES])
    except (KeyError, TypeError, ValueError):
        told = None
    if isinstance(told, list) and len(told) == width:
        return tuple(map(str, told))
    short = name.rpartition(".")[2]
    return (short,) if width == 1 else tuple(f"{short}_{place}" for place in range(width))
