"""MS-TCN folders: step lists of videos, without the videos."""

from pathlib import Path

from teasim.common.errors import ConfigError
from teasim.pool.mstcn.folder import is_mstcn_folder
from teasim.pool.mstcn.labels import BACKGROUNDS
from teasim.pool.readers.reader import Reader, ReadOptions
from teasim.pool.sequences import SequencePool


def open_folder(path: Path, options: ReadOptions) -> SequencePool:
    """Open the folder.

    Raises:
        ConfigError: a label that is said to be background is not in the mapping.
        PoolError: it is damaged.
    """
    pool = SequencePool.open(path, options.fps, (*BACKGROUNDS, *options.background_label))
    if options.background_label:
        known = SequencePool.open(path, background=()).subtasks
        for label in options.background_label:
            if label not in known:
                raise ConfigError(
                    f"'{label}' is no label of '{path}'; choose from {', '.join(known)}."
                )
    return pool


READER = Reader("MS-TCN folder", is_mstcn_folder, open_folder, options=("fps", "background_label"))
