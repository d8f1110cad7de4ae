"""What HDF5 files of demonstrations hold: pictures anywhere in their groups, and logs.

A file may be damaged in any way; no array is read that claims much more than the file holds.
"""

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.clips import ArrayClip, ImageClip
from teasim.pool.clips.hdf5 import opened
from teasim.pool.clips.order import MAX_SIDE
from teasim.pool.recordings import listed

SUFFIXES = (".hdf5", ".h5")
MOST_COMPRESSED = 2000
"""Most bytes that one stored byte stands for; deflate reaches 1032."""
LARGEST_CHUNK = 2**29
"""Most bytes of a chunk, which is read as a whole; one picture of 8192 x 8192 has 2**27.6."""
DEEPEST = 6
"""Levels of groups that are searched for pictures; groups may hold themselves."""
JPEG, PNG = b"\xff\xd8\xff", b"\x89PNG"


def root_names(path: Path) -> frozenset[str]:
    """Return the names at the root of an HDF5 file; none if it cannot be read."""
    try:
        with opened(path) as file:
            return frozenset(file)
    except PoolError:
        return frozenset()


def files_in(path: Path) -> list[Path]:
    """Return the HDF5 files of a folder, or the file itself if it is one."""
    found = listed(path) if path.is_dir() else [path]
    return [file for file in found if file.suffix in SUFFIXES and file.is_file()]


def group(parent: Any, name: str) -> Any:
    """Return the group `name` of a group; an empty mapping where there is none."""
    found = parent.get(name)
    return {} if found is None or not hasattr(found, "items") else found


def arrays(parent: Any, prefix: str = "", deepest: int = DEEPEST) -> Iterator[tuple[str, Any]]:
    """Yield the arrays below a group in order of their names, with their paths from there."""
    for name in sorted(parent):
        child = parent.get(name)
        if child is None:
            continue
        if hasattr(child, "shape"):
            yield prefix + name, child
        elif deepest:
            yield from arrays(child, f"{prefix}{name}/", deepest - 1)


def clips_in(path: Path, parent: Any) -> dict[str, ArrayClip | ImageClip]:
    """Return the pictures below a group by the path of their array, dots for slashes.

    Raises:
        PoolError: an array claims more than the file holds.
    """
    if hasattr(parent, "shape"):
        found = {"observations": parent}
    else:
        found = {name.replace("/", "."): data for name, data in arrays(parent)}
    kinds = {name: (data, _kind(data)) for name, data in found.items()}
    return {
        name: kind(path, data.name, 0, checked(path, data).shape[0])
        for name, (data, kind) in kinds.items()
        if kind is not None
    }


def logs_hash(path: Path, logs: Mapping[str, Any]) -> str:
    """Return a hash of the arrays of numbers with one or two axes, by name.

    Others, depth pictures for instance, are passed over.

    Raises:
        PoolError: an array claims more than the file holds.
    """
    content = hashlib.sha256()
    for name in sorted(logs):
        data = logs[name]
        numbers = data.dtype.kind in "fiub" and len(data.shape or ()) in (1, 2)
        if numbers and _kind(data) is None:
            values = np.ascontiguousarray(checked(path, data)[()], dtype="<f4")
            content.update(f"{name} {values.shape}\n".encode())
            content.update(values.tobytes())
    return content.hexdigest()


def is_pictures(data: Any) -> bool:
    """Tell whether an array holds pictures with three colours."""
    return _kind(data) is not None


def _kind(data: Any) -> type[ArrayClip] | type[ImageClip] | None:
    """Return how the pictures in an array are read; None if it holds none with three colours."""
    shape: tuple[int, ...] = data.shape or ()
    if 0 in shape:
        return None
    if data.dtype == np.uint8 and len(shape) == 4 and max(shape[1:]) <= MAX_SIDE:
        return ArrayClip if 3 in (shape[1], shape[3]) else None
    ragged = data.dtype.kind == "O" and data.dtype.metadata == {"vlen": np.dtype("uint8")}
    if (ragged and len(shape) == 1) or (data.dtype == np.uint8 and len(shape) == 2):
        head = np.asarray(data[0]).astype(np.uint8).tobytes()[:4]
        return ImageClip if head.startswith((JPEG, PNG)) else None
    return None


def checked(path: Path, data: Any) -> Any:
    """Return the array if the file can hold what it claims.

    Raises:
        PoolError: it cannot.
    """
    claimed = int(np.prod([1, *(data.shape or ())], dtype=object)) * data.dtype.itemsize
    chunk = int(np.prod([1, *(data.chunks or ())], dtype=object)) * data.dtype.itemsize
    stored = min(data.id.get_storage_size(), path.stat().st_size)
    if claimed > MOST_COMPRESSED * stored or chunk > LARGEST_CHUNK:
        raise PoolError(
            f"The file '{path}' is damaged: '{data.name}' claims {claimed} bytes but "
            f"{stored} are stored."
        )
    return data
