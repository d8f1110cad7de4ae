"""Filter several freshly generated pools and count what the filter finds and what it spares.

The labels of the pools are read for counting only. Exit code 1 when an incorrect demonstration is
missed, or more than one correct demonstration of a pool is flagged.
"""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path

from filtering.config import FilterConfig
from filtering.demo_filter import DemoFilter
from teasim.common.workers import Workers, default_jobs
from teasim.generation import GenerateConfig, generate
from teasim.pool import Pool


@dataclass(frozen=True)
class Counts:
    """What a filter did to one pool."""

    found: int
    """Incorrect demonstrations that were flagged."""
    missed: int
    """Incorrect demonstrations that were not."""
    spared: int
    """Correct demonstrations that were not flagged."""
    accused: int
    """Correct demonstrations that were."""


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the pools are kept between runs")
    parser.add_argument("--pools", type=int, default=10, help="number of pools; seeds 0, 1, ...")
    parser.add_argument("--seq1", type=int, default=10, help="correct demonstrations in each")
    parser.add_argument("--seq3", type=int, default=4, help="incorrect demonstrations in each")
    parser.add_argument("--segmenter", default="auto", help="as in teasim filter")
    parser.add_argument("--decision", default="auto", help="as in teasim filter")
    parser.add_argument("--jobs", type=int, default=default_jobs(), help="processes")
    arguments = parser.parse_args()
    worst = 0
    for seed in range(arguments.pools):
        counts = check(arguments, seed)
        print(f"seed {seed}: {counts}", flush=True)
        worst = max(worst, counts.missed, counts.accused - 1)
    return int(worst > 0)


def check(arguments: argparse.Namespace, seed: int) -> Counts:
    """Make or reopen the pool of `seed`, filter it, and count."""
    root = arguments.folder / f"seed-{seed}"
    config = GenerateConfig(arguments.seq1, 0, arguments.seq3, cameras=("left",), seed=seed)
    finished = (root / "meta" / "info.json").exists()
    pool = (
        Pool.open(root)
        if finished
        else generate(root, config, workers=Workers(arguments.jobs)).pool
    )
    settings = FilterConfig(segmenter=arguments.segmenter, decision=arguments.decision)
    flagged = DemoFilter(settings).fit(pool, workers=Workers(arguments.jobs)).flagged_
    correct = [episode.record.correct for episode in pool.episodes if episode.record is not None]
    pairs = list(zip(flagged.tolist(), correct, strict=True))
    return Counts(
        found=pairs.count((True, False)),
        missed=pairs.count((False, False)),
        spared=pairs.count((False, True)),
        accused=pairs.count((True, True)),
    )


if __name__ == "__main__":
    sys.exit(main())
