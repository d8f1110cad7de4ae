"""A folder of arrays found again by the hash of what they were computed from."""

import contextlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

SUFFIX = ".safetensors"
LIMIT = 2 * 1024**3
"""Most that the folder may hold before the longest unused arrays are removed [bytes]."""


def default_folder() -> Path:
    """Return TEASIM_CACHE, or ~/.cache/teasim."""
    named = os.environ.get("TEASIM_CACHE")
    return (Path(named) if named else Path.home() / ".cache" / "teasim") / "features"


@dataclass(frozen=True)
class ArrayCache:
    """Arrays by key; what cannot be read counts as absent, what cannot be written is not kept."""

    folder: Path
    """Where the arrays are; made when first needed."""
    limit: int = LIMIT
    """Most that the folder may hold [bytes]."""

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
            handle, name = tempfile.mkstemp(dir=self.folder, suffix=".partial")
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(save({"array": np.ascontiguousarray(array)}))
                os.replace(name, self._path(key))
            except BaseException:
                Path(name).unlink(missing_ok=True)
                raise
            self._forget_oldest()

    def _path(self, key: str) -> Path:
        return self.folder / f"{key}{SUFFIX}"

    def _forget_oldest(self) -> None:
        """Remove the longest unused arrays until the folder is within its limit."""
        files = []
        for path in self.folder.glob(f"*{SUFFIX}"):
            with contextlib.suppress(OSError):  # another process may have removed it
                status = path.stat()
                files.append((status.st_mtime_ns, status.st_size, path))
        total = sum(size for _, size, _ in files)
        for _, size, path in sorted(files)[:-1]:
            if total <= self.limit:
                return
            path.unlink(missing_ok=True)
            total -= size
