"""LeRobotDataset folders, v3.0, v2.1 and v2.0; the first is the native form of a pool."""

from pathlib import Path

from teasim.common.errors import ConfigError
from teasim.pool.integrity import check_pool
from teasim.pool.lerobot import Pool, layout
from teasim.pool.readers.reader import Reader, ReadOptions


def recognises(path: Path) -> bool:
    """Tell whether `path` holds a LeRobot data set, finished or not."""
    return any((path / name).exists() for name in (layout.INFO, layout.STAGING))


def open_pool(path: Path, options: ReadOptions) -> Pool:
    """Open the data set.

    Raises:
        ConfigError: a frame rate was given, which the data set stores itself.
        PoolError: it is damaged.
    """
    if options.fps is not None:
        raise ConfigError(f"The pool '{path}' stores its own frame rate; leave out fps.")
    return Pool.open(path)


READER = Reader("LeRobot data set", recognises, open_pool, check_pool)
