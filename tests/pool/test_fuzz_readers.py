"""Whatever the damage, a source is read or refused with a sentence, in bounded memory and time."""

import subprocess
import sys
from pathlib import Path

import pytest

from teasim.pool.readers.registry import READERS
from tests.pool import foreign_inputs as made

NAMES = ("ms_tcn", "robomimic", "minari_jpeg", "aloha", "videos")
"""Per reader one source; LeRobot's has tests of its own."""
CASES = 200


def test_every_reader_is_tried() -> None:
    tried = {made.ALL[name][1] for name in NAMES}
    assert tried == {reader.name for reader in READERS} - {"LeRobot data set"}


@pytest.mark.parametrize("name", NAMES)
def test_damage_of_any_kind_is_a_sentence(name: str) -> None:
    command = [sys.executable, "-W", "error", "-m", "tests.pool.fuzz_readers", name, "0"]
    root = Path(__file__).parents[2]
    done = subprocess.run([*command, str(CASES)], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, f"{done.stdout[-200:]}\n{done.stderr[-2000:]}"
    assert done.stdout.splitlines()[-1].endswith(f" of {CASES} are refused")
