"""Parquet in, NumPy out; damage becomes one sentence."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from teasim.common.errors import PoolError

MOST_ROWS = 50_000_000
"""Most rows of a file that is read: 450 hours at 30 frames per second."""
MOST_WHOLE = 2.0**53
"""Largest whole number that a float holds exactly."""


def read_table(
    path: Path,
    columns: Sequence[str] | None = None,
    wanted: Callable[[str], bool] | None = None,
) -> pa.Table:
    """A parquet file, or those of its columns that are named or wanted.

    Raises:
        PoolError: The file is missing or damaged, or has no such column.
    """
    if not path.is_file():
        raise PoolError(f"The file '{path}' is missing.")
    try:
        with pq.ParquetFile(path, page_checksum_verification=True) as file:
            if file.metadata.num_rows > MOST_ROWS:
                raise PoolError(f"The file '{path}' has more than {MOST_ROWS} rows.")
            present: list[str] = file.schema_arrow.names
            for name in columns or ():
                if name not in present:
                    raise PoolError(
                        f"The file '{path}' has no column '{name}'; it has {', '.join(present)}."
                    )
            if wanted is not None:
                columns = [name for name in present if wanted(name)]
            table = file.read(columns=columns, use_threads=False)
        table.validate(full=True)
    except (OSError, pa.ArrowException, ValueError, OverflowError, MemoryError) as error:
        raise PoolError(f"The file '{path}' is damaged: it is no readable parquet file.") from error
    return table


def write_table(path: Path, table: pa.Table) -> None:
    """Write a parquet file as LeRobot does; every page carries a check sum."""
    pq.write_table(table, path, compression="snappy", write_page_checksum=True)


def read_column(path: Path, name: str) -> pa.ChunkedArray:
    """One column of a parquet file; the last few are kept, as files may hold many demonstrations.

    Raises:
        PoolError: The file is missing or damaged, or has no such column.
    """
    if not path.is_file():
        raise PoolError(f"The file '{path}' is missing.")
    status = path.stat()
    return _read_column(path, name, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=32)
def _read_column(path: Path, name: str, mtime_ns: int, size: int) -> pa.ChunkedArray:
    del mtime_ns, size  # they only tell the cache that the file has changed
    return read_table(path, [name])[name]


def read_columns(path: Path, names: tuple[str, ...]) -> pa.Table:
    """Some columns of a parquet file; the last few answers are kept.

    Raises:
        PoolError: The file is missing or damaged, or lacks a column.
    """
    if not path.is_file():
        raise PoolError(f"The file '{path}' is missing.")
    status = path.stat()
    return _read_columns(path, names, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=4)
def _read_columns(path: Path, names: tuple[str, ...], mtime_ns: int, size: int) -> pa.Table:
    del mtime_ns, size
    return read_table(path, names)


def as_numpy(column: pa.ChunkedArray, name: str = "column") -> np.ndarray:
    """Numbers of an Arrow column: (n,) for scalars, (n, D) for vectors of one length.

    Raises:
        PoolError: A value is missing, or vectors differ in length.
    """
    array = column.combine_chunks()
    if isinstance(array, pa.ChunkedArray):
        array = pa.concat_arrays(array.chunks) if array.num_chunks else pa.array([], column.type)
    if array.null_count:
        raise PoolError(f"The column '{name}' has {array.null_count} missing values.")
    if not pa.types.is_list(array.type) and not pa.types.is_fixed_size_list(array.type):
        return np.array(array.to_numpy(zero_copy_only=False))
    lengths = np.unique(array.value_lengths().to_numpy(zero_copy_only=False))
    flat = array.flatten()
    if len(lengths) > 1:
        raise PoolError(f"The vectors of column '{name}' differ in length.")
    values = as_numpy(pa.chunked_array([flat]), name)
    width = int(lengths[0]) if len(array) else 0
    return values.reshape(len(array), width, *values.shape[1:]) if len(array) else values


def numbers(column: pa.ChunkedArray, name: str) -> np.ndarray:
    """Numbers of a column of scalars, (n,); some writers store each as a list of one.

    Raises:
        PoolError: A value is missing or no single number.
    """
    values = as_numpy(column, name)
    if values.dtype.kind not in "iufb" or values.size != len(column):
        raise PoolError(f"The column '{name}' does not hold one number per row.")
    return values.reshape(len(column))


def whole_numbers(column: pa.ChunkedArray, name: str) -> np.ndarray:
    """Whole numbers of a column, (n,) int64; a round trip through pandas makes floats of them.

    Raises:
        PoolError: A value is missing, no number, or has a fraction.
    """
    values = numbers(column, name)
    if values.dtype.kind == "b":
        raise PoolError(f"The column '{name}' does not hold one number per row.")
    if values.dtype.kind == "f":
        wrong = ~(np.abs(values) <= MOST_WHOLE) | (values != np.trunc(values))
        if wrong.any():
            raise PoolError(f"The column '{name}' holds {values[wrong][0]}, no whole number.")
    return values.astype(np.int64)
