"""Killing what writes at any moment, and hashing what it leaves.

    python -m tests.pool.faults FOLDER --kills 8

The checks run in a process without threads of its own, because they fork.
"""

import argparse
import hashlib
import os
import random
import shutil
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from teasim.pool import claim_folder, episode_is_done, finalize_pool
from teasim.pool.lerobot import layout
from teasim.pool.readers.registry import check_source, open_source
from teasim.pool.writers.content import Choice, content_of
from teasim.pool.writers.registry import WRITERS
from teasim.pool.writers.writing import staging_of, write
from tests.toy_pool import toy_header, write_toy_episode

SEQUENCES = (("pour", "stir"), ("stir", "pour"), ("pour", "pour"))


def hashes(root: Path) -> dict[str, str]:
    """Hash of every file below a folder, or of a file, by its name."""
    files = [root] if root.is_file() else sorted(p for p in root.rglob("*") if p.is_file())
    return {str(p.relative_to(root)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}


def write_pool(root: Path) -> None:
    """Write a pool as `generate` does: demonstrations that are not finished yet, then the whole."""
    if (root / layout.INFO).exists():
        return
    header = toy_header(SEQUENCES, size=32)
    claim_folder(root, header)
    for index, sequence in enumerate(SEQUENCES):
        if not episode_is_done(root, index, header):
            write_toy_episode(root, index, header, sequence, frames_per_subtask=4)
    finalize_pool(root, header, len(SEQUENCES))


def convert(source: Path, dest: Path, name: str) -> None:
    """Convert a source; what is finished already stays."""
    if dest.exists() and not staging_of(dest).exists():
        return
    opened = open_source(source)
    write(WRITERS[name], opened, content_of(opened, Choice()), dest)


def killed(work: Callable[[], None], after: float) -> bool:
    """Run `work` in a process that is killed after some seconds; whether it was still at work."""
    process = os.fork()
    if process == 0:
        try:
            work()
        finally:
            os._exit(0)
    time.sleep(after)
    os.kill(process, signal.SIGKILL)
    _, status = os.waitpid(process, 0)
    return os.WIFSIGNALED(status)


def check(work: Callable[[Path], None], home: Path, kills: int, rng: random.Random) -> int:
    """Kill `work` again and again, then let it finish: the bytes are those of a whole run.

    Returns:
        How often it was killed before it was done.
    """
    suffix = ".hdf5" if "robomimic" in home.name else ""
    whole, broken = home / f"whole{suffix}", home / "broken" / f"set{suffix}"
    work(whole)
    began = time.perf_counter()
    work(home / f"timed{suffix}")
    usual = time.perf_counter() - began
    n_killed = 0
    while n_killed < kills:
        tidied = not (broken / layout.INFO).exists()  # or killed as it was tidied up
        if killed(lambda: work(broken), rng.uniform(0, usual)):
            n_killed += 1
        else:
            if not tidied:
                shutil.rmtree(broken / layout.STAGING, ignore_errors=True)
            assert hashes(broken) == hashes(whole), broken
            shutil.rmtree(broken.parent)
    work(broken)
    shutil.rmtree(broken / layout.STAGING, ignore_errors=True)  # killed as it was tidied up
    assert hashes(broken) == hashes(whole), broken
    assert check_source(broken) == []
    assert [p.name for p in broken.parent.iterdir() if p.suffix == ".incomplete"] == []
    return n_killed


def main() -> int:
    """Kill the writer of pools, and conversions to every format."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="empty folder for what is written")
    parser.add_argument("--kills", type=int, default=8, help="kills per kind of writing")
    parser.add_argument("--formats", nargs="+", default=list(WRITERS), help="formats to convert to")
    parser.add_argument("--seed", type=int, default=0, help="seed of the moments of the kills")
    given = parser.parse_args()
    rng = random.Random(given.seed)
    source = given.folder / "source"
    write_pool(source)
    before = hashes(source)
    print("pool:", check(write_pool, given.folder / "pool", given.kills, rng))
    for name in given.formats:
        work = lambda dest, name=name: convert(source, dest, name)  # noqa: E731
        print(f"{name}:", check(work, given.folder / name, given.kills, rng))
    assert hashes(source) == before
    return 0


if __name__ == "__main__":
    sys.exit(main())
