"""Kill an ablation at random moments (SIGKILL), resume it, and compare its tables with a whole run.

The plan makes its own pool, without video, so that everything takes about a minute.
"""

import argparse
import random
import subprocess
import sys
import time
from pathlib import Path

PLAN = """
learners = ["bc", "r-maxent"]
observe = "state"
segmenter = "logged"
episodes = 2
[pools.small]
seq1 = 4
seq3 = 1
video = false
seed = 400
[filters.all]
use = "ignore"
[filters.norm]
use = "discard"
[filters.random]
use = "random"
"""
FILES = ("results.csv", "results.parquet", "results.md", "results.html", "detection.csv")
"""Files that must be equal byte for byte."""


def main() -> int:
    """Return 0 if all files are equal, else 1."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="new folder")
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--seed", type=int, default=0, help="of the moments")
    arguments = parser.parse_args()
    home: Path = arguments.folder
    home.mkdir(parents=True)
    (home / "plan.toml").write_text(PLAN)
    began = time.perf_counter()
    _start(home, "whole").wait()
    seconds = time.perf_counter() - began
    rng, kills = random.Random(arguments.seed), 0
    for _ in range(arguments.kills):
        process = _start(home, "broken")
        try:
            process.wait(rng.uniform(0.0, seconds / 2))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            kills += 1
    _start(home, "broken").wait()
    differ = [
        name
        for name in FILES
        if (home / "whole" / name).read_bytes() != (home / "broken" / name).read_bytes()
    ]
    print(f"killed {kills} times; files that differ: {', '.join(differ) or 'none'}")
    return int(bool(differ))


def _start(home: Path, out: str) -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "teasim", "ablate", home / "plan.toml", "-o", home / out]
    return subprocess.Popen([*command, "--jobs", "1"], stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    sys.exit(main())
