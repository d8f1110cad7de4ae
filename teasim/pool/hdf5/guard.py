"""A first look into HDF5 files in a process of its own.

The HDF5 library can wait for ever, or end the process, where a damaged file misleads it (seen in
the global heap of version 2.0, which holds texts and ragged rows). What happens in a process of its
own harms nobody, and can be stopped.
"""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from teasim.common.errors import PoolError

LONGEST = 10.0
"""Time after which the look at a small file is stopped [s]; an ordinary one takes 0.3 s."""
LONGEST_PER_BYTE = 2e-7
"""What is added to it for larger files [s/byte]; they hold more to look at."""

LOOK = """
import contextlib, sys, h5py

def look(name, thing):
    for key in list(thing.attrs):
        with contextlib.suppress(Exception):
            thing.attrs[key]
    ragged = isinstance(thing, h5py.Dataset) and thing.dtype.kind == "O" and thing.ndim
    for row in (0, -1) if ragged else ():
        with contextlib.suppress(Exception):
            thing[row]

with contextlib.suppress(Exception), h5py.File(sys.argv[1], "r", locking="best-effort") as file:
    look("", file)
    file.visititems(look)
"""
"""Reads all attributes, and the first and last of ragged rows; errors are left to the reader."""


def require_readable(paths: Sequence[Path]) -> None:
    """Refuse files that the HDF5 library cannot read without harm to this process.

    Raises:
        PoolError: the library waits for ever or ends the process.
    """
    for path in paths:
        command = [sys.executable, "-c", LOOK, str(path)]
        longest = LONGEST + LONGEST_PER_BYTE * path.stat().st_size
        try:
            ended = subprocess.run(command, capture_output=True, timeout=longest).returncode
        except subprocess.TimeoutExpired:
            ended = -1
        if ended < 0:  # stopped, or killed by a signal
            raise PoolError(f"The file '{path}' is damaged and cannot be read.")
