"""A folder of arrays found again by the hash of what they were computed from."""

import contextlib
import os
import re
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from teasim.common.errors import ConfigError

SUFFIX, PARTIAL = ".safetensors", ".partial"
LIMIT = "10GB"
"""Most that the folder may hold, unless TEASIM_CACHE_LIMIT says otherwise."""
UNITS = {"": 1, "B": 1, "KB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12}
SIZE = re.compile(r"(\d{1,12}(?:\.\d{1,12})?)\s*([KMGT]?B?)", re.IGNORECASE)


def default_folder() -> Path:
    """Return TEASIM_CACHE, or ~/.cache/teasim."""
    named = os.environ.get("TEASIM_CACHE")
    return (Path(named) if named else Path.home() / ".cache" / "teasim") / "features"


def default_limit() -> int:
    """Return TEASIM_CACHE_LIMIT, e.g. 5GB, or `LIMIT` [bytes].

    Raises:
        ConfigError: the variable holds no size.
    """
    return parse_size(os.environ.get("TEASIM_CACHE_LIMIT") or LIMIT, "TEASIM_CACHE_LIMIT")


def parse_size(text: str, what: str) -> int:
    """Return a size such as 5GB or 500MB in bytes.

    Raises:
        ConfigError: `text` is none; `what` is where it is from.
    """
    match = SIZE.fullmatch(text.strip())
    unit = match[2].upper() if match else ""
    unit = unit if unit in UNITS else f"{unit}B"
    if match is None or unit not in UNITS:
        raise ConfigError(f"{what} is '{text}'; write a size such as 5GB or 500MB.")
    return int(float(match[1]) * UNITS[unit])


@dataclass(frozen=True)
class ArrayCache:
    """Arrays by key; what cannot be read counts as absent, what cannot be written is not kept."""

    folder: Path
    """Where the arrays are; made when first needed."""
    limit: int | None = None
    """Most that the folder may hold [bytes]; None for `default_limit`."""

    def get(self, key: str) -> np.ndarray | None:
        """Return the array stored under `key`, or None."""
        path = self._path(key)
        try:
            array = load(path.read_bytes())["array"]
            os.utime(path)
        except (OSError, SafetensorError, KeyError, ValueError):
            return None
        return array

    def put(self, key: str, array: np.ndarray) -> None:
        """Store `array` under `key`; readers see the whole array or none of it."""
        with contextlib.suppress(OSError):
            self.folder.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self.folder, suffix=PARTIAL)
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(save({"array": np.ascontiguousarray(array)}))
                os.replace(name, self._path(key))
            except BaseException:
                Path(name).unlink(missing_ok=True)
                raise
            self.shrink(default_limit() if self.limit is None else self.limit)

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}{SUFFIX}"

    def size(self) -> tuple[int, int]:
        """Return the number of arrays and the bytes that they take."""
        files = self._files()
        return len(files), sum(size for _, size, _ in files)

    def clear(self) -> None:
        """Remove all arrays, and what is left of interrupted writing."""
        for path in (*self.folder.glob(f"*{SUFFIX}"), *self.folder.glob(f"*{PARTIAL}")):
            path.unlink(missing_ok=True)

    def shrink(self, limit: int) -> None:
        """Remove the longest unused arrays until at most `limit` bytes, or one array, are left."""
        files = self._files()
        total = sum(size for _, size, _ in files)
        for _, size, path in sorted(files)[:-1]:
            if total <= limit:
                return
            path.unlink(missing_ok=True)
            total -= size

    def _files(self) -> list[tuple[int, int, Path]]:
        """Return time of last use [ns], size [bytes] and path of each array."""
        files = []
        for path in self.folder.glob(f"*{SUFFIX}"):
            with contextlib.suppress(OSError):  # another process may have removed it
                status = path.stat()
                files.append((status.st_mtime_ns, status.st_size, path))
        return files
