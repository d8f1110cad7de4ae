"""Measure how well single clues reveal mistakes in length-matched pools with all of them.

The exit code is 1 if the mean AUROC of a clue over the pools differs from 0.5 by more than 0.1.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

from teasim.common.workers import Workers, default_jobs
from teasim.generation import GenerateConfig, generate
from teasim.pool import Pool
from teasim.pool.leakage import CLUES, leakage
from teasim.task.mistakes import MISTAKES

TOLERANCE = 0.1
"""Largest distance of a mean AUROC from 0.5."""


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="folder of the pools, which are reused")
    parser.add_argument(
        "--pools", type=int, default=20, help="number of pools, with seeds 0, 1, ..."
    )
    parser.add_argument("--correct", type=int, default=10, help="correct demonstrations in each")
    parser.add_argument(
        "--each", type=int, default=1, help="demonstrations of each mistake in each"
    )
    parser.add_argument("--size", type=int, default=224, help="side of the videos [pixels]")
    parser.add_argument("--cameras", nargs="+", default=["left"], help="cameras that film")
    parser.add_argument("--jobs", type=int, default=default_jobs(), help="number of processes")
    arguments = parser.parse_args()
    found = [leakage(_pool(arguments, seed)) for seed in range(arguments.pools)]
    table = {clue: np.array([values[clue] for values in found]) for clue in CLUES}
    print(f"AUROC over {arguments.pools} pools, incorrect against correct: mean, then spread")
    for clue, values in table.items():
        print(f"  {clue:20}{values.mean():.3f}  {values.std():.3f}")
    return int(any(abs(values.mean() - 0.5) > TOLERANCE for values in table.values()))


def _pool(arguments: argparse.Namespace, seed: int) -> Pool:
    root = arguments.folder / f"seed-{seed}"
    if (root / "meta" / "info.json").exists():
        return Pool.open(root)
    config = GenerateConfig(
        seq1=arguments.correct,
        mistakes=tuple((name, arguments.each) for name in MISTAKES),
        match_length=True,
        cameras=tuple(arguments.cameras),
        size=arguments.size,
        seed=seed,
    )
    return generate(root, config, workers=Workers(arguments.jobs)).pool


if __name__ == "__main__":
    sys.exit(main())
