"""Opening one dataset of an HDF5 file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from teasim.common.errors import PoolError


@contextmanager
def opened_dataset(path: Path, name: str) -> Iterator[Any]:
    """Open the dataset `name`, e.g. 'data/demo_0/obs/agentview_image', for reading.

    Yields:
        `h5py.Dataset`.

    Raises:
        PoolError: h5py is not installed, the file is missing or damaged, or has no such dataset.
    """
    try:
        import h5py
    except ImportError as error:
        raise PoolError(
            f"Reading '{path}' needs h5py; install it with: pip install 'teasim[hdf5]'."
        ) from error
    if not path.is_file():
        raise PoolError(f"The file '{path}' is missing.")
    try:
        with h5py.File(path, "r") as file:
            dataset = file.get(name)
            if not isinstance(dataset, h5py.Dataset):
                raise PoolError(f"The file '{path}' has no dataset '{name}'.")
            yield dataset
    except (OSError, RuntimeError, KeyError) as error:  # what h5py raises for damaged files
        raise PoolError(f"The file '{path}' is damaged and cannot be read.") from error
