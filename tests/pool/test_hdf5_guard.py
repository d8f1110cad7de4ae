"""A file that makes the HDF5 library wait for ever, or crash, is refused in a sentence."""

from pathlib import Path

import pytest

from teasim.common.errors import PoolError
from teasim.pool.hdf5 import guard
from tests.pool import foreign_inputs as made


@pytest.mark.parametrize("harm", ["import time; time.sleep(60)", "import os; os.abort()"])
def test_harm_is_kept_out_of_this_process(tmp_path: Path, monkeypatch, harm: str) -> None:
    path = tmp_path / "demo.hdf5"
    path.write_bytes(b"")
    monkeypatch.setattr(guard, "LOOK", harm)
    monkeypatch.setattr(guard, "LONGEST", 0.5)
    with pytest.raises(PoolError) as caught:
        guard.require_readable([path])
    assert str(caught.value) == f"The file '{path}' is damaged and cannot be read."


def test_what_can_be_read_is_let_through(tmp_path: Path) -> None:
    robomimic = made.robomimic(tmp_path / "in")
    guard.require_readable([next(robomimic.rglob("*.hdf5")) if robomimic.is_dir() else robomimic])
    (tmp_path / "no.hdf5").write_text("not HDF5")  # an error is left to the reader
    guard.require_readable([tmp_path / "no.hdf5"])
