"""The program that checks many demonstrations."""

import subprocess
import sys
from pathlib import Path

import pytest

PROGRAM = Path(__file__).parents[2] / "scripts" / "check_skills.py"


def check(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(PROGRAM), *options]
    return subprocess.run(command, capture_output=True, text=True)


@pytest.mark.slow
def test_a_demonstration_is_checked_and_reported():
    done = check("--seeds", "1", "--jobs", "1", "--sequence", "seq_3")
    assert (done.returncode, done.stderr) == (0, "")
    rows = dict(line.split(maxsplit=2)[0::2] for line in done.stdout.splitlines())
    assert rows["as"].strip() == "1 of 1"
    assert rows["without"].strip() == "1 of 1"
    assert rows["most"].strip() == "0.0 ml or g"


def test_nothing_to_check_is_a_usage_error():
    done = check("--seeds", "0")
    assert done.returncode == 2
    assert "--seeds and --jobs have to be 1 or more" in done.stderr
