"""The writers by name; a new format is one line here and one file."""

from pathlib import Path

from teasim.common.errors import ConfigError
from teasim.common.registry import named
from teasim.pool.lerobot import layout
from teasim.pool.readers.registry import reader_of
from teasim.pool.writers import minari, ms_tcn, robomimic, videos
from teasim.pool.writers.lerobot import v21, v30
from teasim.pool.writers.writer import Writer

WRITERS: dict[str, Writer] = {
    writer.name: writer
    for writer in (
        v30.WRITER,
        v21.WRITER,
        robomimic.WRITER,
        minari.WRITER,
        videos.WRITER,
        ms_tcn.WRITER,
    )
}
"""Every format that can be written."""


def writer_named(name: str) -> Writer:
    """Return the writer of a format.

    Raises:
        ConfigError: there is no such format.
    """
    return named("format", WRITERS, name)


def writer_like(source: Path) -> Writer:
    """Return the writer of the format that `source` is in.

    Raises:
        ConfigError: that format can be read but not written.
        PoolError: no reader recognises the source.
    """
    if (source / layout.EPISODES_LINES).exists():
        return v21.WRITER
    reader = reader_of(source).name
    for writer in WRITERS.values():
        if writer.reader == reader:
            return writer
    raise ConfigError(
        f"'{source}' is read as {reader}, which cannot be written; choose --to "
        f"{', '.join(WRITERS)}."
    )
