"""Where results go: an output folder is new or empty, so nothing that exists is ever harmed."""

from pathlib import Path

from teasim.errors import ConfigError
from teasim.pool.files import write_atomically


def check_folder(path: Path) -> None:
    """Raise ConfigError unless `path` is free: nothing there yet, or an empty folder."""
    if path.is_dir() and any(path.iterdir()):
        raise ConfigError(f"The output folder '{path}' is in use; choose a new or empty one.")
    if path.exists() and not path.is_dir():
        raise ConfigError(f"The output folder '{path}' is a file; choose a new or empty folder.")


def check_file(path: Path | None) -> None:
    """Raise ConfigError if `path`, when given, cannot become a file."""
    if path is not None and path.is_dir():
        raise ConfigError(f"The output file '{path}' is a folder; name a file in it.")


def write_bytes(path: Path, data: bytes) -> None:
    """Write `data` to `path`, wholly or not at all."""

    def fill(target: Path) -> None:
        target.write_bytes(data)

    write_atomically(path, fill)
