"""The readers in the order in which they are tried; a new format is one line here and one file."""

from pathlib import Path

from teasim.common.errors import ConfigError, PoolError
from teasim.pool import hub
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
        path: a folder or file, or the name of a data set in the local cache of the Hugging Face
            Hub (`teasim.pool.hub`) or of Minari.
        options: what the format does not store; None means nothing was said.

    Raises:
        ConfigError: an option does not fit the format.
        PoolError: no reader recognises it, or it is damaged.
    """
    place, options = located(path), options or ReadOptions()
    reader = reader_of(place)
    for name in options.given():
        if name not in reader.options:
            raise ConfigError(
                f"The option {name} does not apply to '{place}' ({reader.name}); leave it out."
            )
    return reader.open(place, options)


def located(path: Path | str) -> Path:
    """Return the path itself, or where the local copy of the data set of that name is stored."""
    copy = hub.located(path)
    if copy.exists():
        return copy
    found = (reader.find(str(path)) for reader in READERS if reader.find is not None)
    return next((place for place in found if place is not None), copy)


def check_source(path: Path | str, options: ReadOptions | None = None) -> list[str]:
    """Look for damage in all of what is stored at `path`, pictures included.

    Returns:
        One sentence per problem; empty when the source is sound.

    Raises:
        ConfigError: an option does not fit the format.
        PoolError: no reader recognises it.
    """
    place = located(path)
    reader = reader_of(place)
    if reader.check is not None:
        return reader.check(place)
    try:
        return reader.open(place, options or ReadOptions()).problems()
    except PoolError as error:
        return [str(error)]


def reader_of(path: Path) -> Reader:
    """Return the reader that recognises `path`.

    Raises:
        PoolError: there is nothing at `path`, or no reader recognises it.
    """
    path = located(path)
    if not path.exists():
        raise PoolError(hub.missing(path))
    for reader in READERS:
        if reader.recognises(path):
            return reader
    known = ", ".join(reader.name for reader in READERS)
    if path.is_dir() and not any(path.iterdir()):
        raise PoolError(f"The folder '{path}' is empty; a source is one of: {known}.")
    raise PoolError(f"'{path}' is in no format that can be read; a source is one of: {known}.")
