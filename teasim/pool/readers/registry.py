"""The readers in the order in which they are tried; a new format is one line here and one file."""

from pathlib import Path

from teasim.common.errors import ConfigError, PoolError
from teasim.pool.readers import aloha, lerobot, minari, ms_tcn, robomimic, videos
from teasim.pool.readers.reader import Reader, ReadOptions
from teasim.pool.source import Source

READERS: tuple[Reader, ...] = (
    lerobot.READER,
    ms_tcn.READER,
    minari.READER,
    aloha.READER,
    robomimic.READER,
    videos.READER,
)
"""Every format that can be read."""


def open_source(path: Path | str, options: ReadOptions | None = None) -> Source:
    """Open what is stored at `path`, whatever its format.

    Args:
        path: a folder or file.
        options: what the format does not store; None means nothing was said.

    Raises:
        ConfigError: an option does not fit the format.
        PoolError: no reader recognises it, or it is damaged.
    """
    place, options = found_by_reader(path), options or ReadOptions()
    reader = reader_of(place)
    for name in options.given():
        if name not in reader.options:
            raise ConfigError(
                f"The option {name} does not apply to '{place}' ({reader.name}); leave it out."
            )
    return reader.open(place, options)


def found_by_reader(path: Path | str) -> Path:
    """Return the path itself, or where a reader finds a data set of that name."""
    if not Path(path).exists():
        for reader in READERS:
            place = reader.find(str(path)) if reader.find else None
            if place is not None:
                return place
    return Path(path)


def reader_of(path: Path) -> Reader:
    """Return the reader that recognises `path`.

    Raises:
        PoolError: there is nothing at `path`, or no reader recognises it.
    """
    if not path.exists():
        raise PoolError(f"There is nothing at '{path}'; name a folder with demonstrations.")
    for reader in READERS:
        if reader.recognises(path):
            return reader
    known = ", ".join(reader.name for reader in READERS)
    if path.is_dir() and not any(path.iterdir()):
        raise PoolError(f"The folder '{path}' is empty; a source is one of: {known}.")
    raise PoolError(f"'{path}' is in no format that can be read; a source is one of: {known}.")
