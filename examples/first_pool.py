"""Generate a small pool with a mistake in it, and filter it from its videos alone.

    python examples/first_pool.py FOLDER

Takes about a minute. The folder must be new.
"""

import sys
from pathlib import Path

from filtering import DemoFilter
from teasim import generate
from teasim.generation.config import GenerateConfig


def main(folder: Path) -> None:
    """Generate six demonstrations, of which one leaves a step out, and print their weights."""
    config = GenerateConfig(
        seq1=5, mistakes=(("skip@add_milk", 1),), size=96, cameras=("left",), seed=7
    )
    pool = generate(folder, config).pool
    found = DemoFilter().fit(pool)
    for episode, weight, reason in zip(pool.episodes, found.weights_, found.reasons_, strict=True):
        print(f"{episode.index}  weight {weight:.2f}  {reason}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
