"""MS-TCN folders: step lists of videos, without the videos."""

from pathlib import Path

from teasim.pool.mstcn import is_mstcn_folder
from teasim.pool.readers.reader import Reader, ReadOptions
from teasim.pool.sequences import SequencePool


def open_folder(path: Path, options: ReadOptions) -> SequencePool:
    """Open the folder.

    Raises:
        PoolError: it is damaged.
    """
    return SequencePool.open(path, options.fps)


READER = Reader("MS-TCN folder", is_mstcn_folder, open_folder)
