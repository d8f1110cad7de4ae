"""One writer at a time: a lock file beside what is written, freed when its process ends."""

import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from teasim.common.errors import ConfigError


@contextmanager
def locked(path: Path) -> Iterator[None]:
    """Hold the lock of `path` while the block runs.

    The lock file, .NAME.lock, names process and host. The system frees the lock of a process that
    ends in any way, so a file that a killed process left behind is taken over.

    Raises:
        ConfigError: another process holds it.
        OSError: the lock file cannot be written.
    """
    place = path.with_name(f".{path.name}.lock")
    descriptor = _acquired(path, place)
    try:
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"{os.getpid()} {socket.gethostname()}\n".encode(), 0)
        yield
    finally:
        place.unlink(missing_ok=True)
        os.close(descriptor)


def _acquired(path: Path, place: Path) -> int:
    while True:
        descriptor = os.open(place, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            holder = os.pread(descriptor, 200, 0).decode(errors="replace").split()
            os.close(descriptor)
            pid, host = (*holder, "unknown", "unknown")[:2]
            raise ConfigError(
                f"'{path}' is being written by process {pid} on {host}; wait until it ends, or "
                "choose another destination."
            ) from error
        except OSError:
            os.close(descriptor)
            raise
        if _is_same(descriptor, place):
            return descriptor
        os.close(descriptor)  # its holder removed it between the two calls


def _is_same(descriptor: int, place: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(descriptor), place.stat())
    except FileNotFoundError:
        return False
