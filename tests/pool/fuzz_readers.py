"""Damage a small source at random and read all of it: it is read, or one sentence says why not.

python -m tests.pool.fuzz_readers NAME FIRST_SEED COUNT    in a process of its own: C code may crash
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from teasim.common.errors import TeasimError
from teasim.pool.mstcn.folder import MSTCNFolder
from teasim.pool.readers.registry import open_source
from tests.pool import foreign_inputs as made

MOST_SECONDS = 40.0
"""Longest time of one case [s]; a sound source takes about 0.3 s, and a look at a damaged HDF5 file
is stopped after 10 s (`teasim.pool.hdf5.guard`)."""
MOST_BYTES = 400 * 2**20
"""Most memory that all cases may need beyond what a sound source needs."""


def sound(name: str) -> dict[str, bytes]:
    """The files of a source with two demonstrations by relative name."""
    made.LENGTHS = (5, 4)
    with tempfile.TemporaryDirectory() as home:
        made.ALL[name][0](Path(home) / "source")
        files = (path for path in sorted(Path(home).rglob("*")) if path.is_file())
        return {str(path.relative_to(home)): path.read_bytes() for path in files}


def damaged(rng: np.random.Generator, content: bytes) -> bytes:
    """Change a few bytes, cut, repeat, or blank a part; half of the changes are near the start."""
    data = bytearray(content)
    for _ in range(int(rng.integers(1, 6))):
        reach = len(data) if rng.random() < 0.5 else min(len(data), 3000)
        start = int(rng.integers(0, max(reach, 1)))
        stop = start + int(rng.integers(1, 40))
        match int(rng.integers(0, 8)):
            case 0:
                del data[start:]
            case 1:
                del data[start:stop]
            case 2:
                data[start:start] = data[start:stop]
            case 3:
                data[start:stop] = bytes([int(rng.choice([0, 255, 35, 10]))]) * (stop - start)
            case _:
                data[start : start + 1] = rng.bytes(1)
    return bytes(data)


def read_all(path: Path) -> None:
    """Read everything that a filter may read, and check that it fits together."""
    source = open_source(path)
    assert source.notes is not None
    source.content_hash()
    indexes = [demo.index for demo in source.episodes]
    assert len(source.entries(indexes)) == len(indexes) > 0
    for demo in source.episodes:
        assert demo.length > 0
        assert demo.demo_id
        spans = [*demo.spans()]
        assert all(0 <= span.start < span.stop <= demo.length for span in spans)
        assert {span.subtask for span in spans} <= set(source.subtasks)
        for camera in source.cameras:
            images = demo.clip(camera).frames(range(demo.length))
            assert images.dtype == np.uint8
            assert images.shape[0] == demo.length
            assert images.shape[3] == 3


def read(name: str, path: Path) -> str:
    """Return why the source cannot be read; empty when it can."""
    try:
        read_all(path)
        if name == "ms_tcn":
            folder = MSTCNFolder.open(path)
            assert all(folder.features(video).ndim == 2 for video in folder.feature_files)
    except TeasimError as error:
        return str(error)
    return ""


def main(name: str, first: int, count: int) -> None:
    """Read `count` damaged sources; the seed of each is printed before it is read."""
    files, said = sound(name), 0
    with tempfile.TemporaryDirectory() as home:
        place = Path(home) / "source"
        for seed in range(first - 1, first + count):
            rng = np.random.default_rng(seed + 1)
            victim = str(rng.choice(sorted(files)))
            for relative, content in files.items():
                target = Path(home) / relative
                target.parent.mkdir(parents=True, exist_ok=True)
                hit = relative == victim and seed >= first
                target.write_bytes(damaged(rng, content) if hit else content)
            print(f"seed {seed}", flush=True)
            began = time.monotonic()
            refusal = read(name, place)
            assert time.monotonic() - began < MOST_SECONDS
            assert "\n" not in refusal
            assert seed >= first or not refusal, refusal
            said += bool(refusal)
            peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
            if seed < first:
                allowed = peak + MOST_BYTES
            assert peak < allowed, f"{peak} bytes"
    print(f"{said} of {count} are refused")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
