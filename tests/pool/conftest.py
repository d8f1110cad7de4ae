"""Two sound pools: one of ours and one by another hand. Tests damage copies."""

import subprocess
import sys
from pathlib import Path

import pytest

from teasim.pool import Pool
from tests.toy_pool import SEQ_1, SEQ_2, make_toy_pool

SKIP_OFF = tuple(name for name in SEQ_1 if name != "turn_off_oven")
BIN = Path(sys.executable).parent


@pytest.fixture(scope="session")
def toy_pool(tmp_path_factory: pytest.TempPathFactory) -> Pool:
    folder = tmp_path_factory.mktemp("pools") / "toy"
    return make_toy_pool(folder, [SEQ_1, SEQ_2, SKIP_OFF], size=48, frames_per_subtask=6)


@pytest.fixture(scope="session")
def foreign_pool(tmp_path_factory: pytest.TempPathFactory) -> Pool:
    """Several demonstrations per file, two cameras, no ground truth."""
    folder = tmp_path_factory.mktemp("pools") / "foreign"
    command = [BIN / "robovet", "demo", folder, "--v3", "--clean"]
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    return Pool.open(folder)
