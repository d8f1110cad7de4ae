"""Write the videos of the scenes: one pool of all kinds of videos per scene, below a folder."""

import argparse
import sys
import time
from pathlib import Path

from scenes.parts.writing import make_bank
from scenes.registry import SCENES

from teasim.common.workers import Workers


def main() -> int:
    """Write them; those that are there stay as they are."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where to write, one folder per scene")
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=list(SCENES))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    arguments = parser.parse_args()
    for name in arguments.scenes:
        start = time.perf_counter()
        pool = make_bank(
            arguments.folder / name,
            SCENES[name],
            seed=arguments.seed,
            workers=Workers(arguments.jobs),
        )
        seconds = time.perf_counter() - start
        print(f"{name}: {len(pool.episodes)} videos, {seconds:.0f} s", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
