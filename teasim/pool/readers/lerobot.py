"""LeRobotDataset folders, v3.0, v2.1 and v2.0; the first is the native form of a pool."""

from pathlib import Path

from teasim.pool.hub import copy_of
from teasim.pool.integrity import check_pool
from teasim.pool.lerobot import Pool, layout
from teasim.pool.readers.reader import Reader, ReadOptions


def recognises(path: Path) -> bool:
    """Tell whether `path` holds a LeRobot data set, finished or not."""
    return any((path / name).exists() for name in (layout.INFO, layout.STAGING))


def open_pool(path: Path, options: ReadOptions) -> Pool:
    """Open the data set, which stores all that the options could tell.

    Raises:
        PoolError: it is damaged.
    """
    del options  # none is looked at
    return Pool.open(path)


READER = Reader("LeRobot data set", recognises, open_pool, check_pool, options=(), find=copy_of)
