"""Opening HDF5 files for reading; whatever is wrong with one becomes a sentence."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from teasim.common.errors import PoolError, TeasimError


def library(path: Path) -> Any:
    """Return the module h5py.

    Raises:
        PoolError: it is not installed, so that `path` cannot be read.
    """
    try:
        import h5py
    except ImportError as error:
        raise PoolError(
            f"Reading '{path}' needs h5py; install it with: pip install 'teasim[hdf5]'."
        ) from error
    return h5py


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open an HDF5 file for reading.

    Yields:
        `h5py.File`.

    Raises:
        PoolError: h5py is not installed, the file is missing, or reading it in the block fails.
    """
    h5py = library(path)
    if not path.is_file():
        raise PoolError(f"The file '{path}' is missing.")
    try:
        with h5py.File(path, "r", locking="best-effort") as file:
            yield file
    except TeasimError:
        raise
    except Exception as error:  # damaged files make h5py raise nearly every kind of exception
        raise PoolError(f"The file '{path}' is damaged and cannot be read.") from error


@contextmanager
def opened_dataset(path: Path, name: str) -> Iterator[Any]:
    """Open the dataset `name`, e.g. 'data/demo_0/obs/agentview_image', for reading.

    Yields:
        `h5py.Dataset`.

    Raises:
        PoolError: h5py is not installed, the file is missing or damaged, or has no such dataset.
    """
    with opened(path) as file:
        dataset = file.get(name)
        if not isinstance(dataset, library(path).Dataset):
            raise PoolError(f"The file '{path}' has no dataset '{name}'.")
        yield dataset
