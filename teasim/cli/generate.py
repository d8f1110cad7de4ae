"""The verb `generate`: render a pool of demonstrations."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import tyro

from teasim.common.cli import parse, resumable
from teasim.common.workers import WorkerOptions, Workers
from teasim.generation.config import GenerateConfig, PoolOptions

EXAMPLES = (
    "teasim generate pool --seq1 10 --mistakes skip:2 ineffective@add_milk",
    "teasim generate states --seq1 50 --no-video --execution-noise 0.005",
)


@dataclass(frozen=True)
class GenerateArguments:
    """Render a pool of tea-making demonstrations, with mistakes in it when asked for."""

    pool: Annotated[Path, tyro.conf.Positional]
    """Folder to write, new or empty. An unfinished pool of the same settings is resumed."""
    options: Annotated[PoolOptions, tyro.conf.arg(name="")]
    """The settings of the pool."""
    preset: str | None = None
    """A named set of pools. paper: the pools of the paper, 36 videos of people and 12 of YuMi, in
    two folders below PATH. Of the other settings, a preset uses only --camera, --size, --quality,
    --look and --seed."""
    workers: WorkerOptions = field(default_factory=Workers)
    """Where the work runs."""


@resumable
def main(argv: Sequence[str] | None = None) -> int:
    """Render a pool of tea-making demonstrations, with mistakes in it when asked for."""
    arguments = parse(GenerateArguments, argv, verb="generate", examples=EXAMPLES)
    pools = _pools(arguments)
    from teasim.generation.making import generate

    start = time.perf_counter()
    remade = count = 0
    for folder, config in pools.items():
        made = generate(folder, config, workers=arguments.workers)
        count, remade = count + len(made.pool.episodes), remade + made.remade
    seconds = time.perf_counter() - start
    print(
        f"{count} demonstrations in {arguments.pool} ({seconds:.0f} s, "
        f"{remade} made again because they did not come out as labelled)"
    )
    return 0


def _pools(arguments: GenerateArguments) -> dict[Path, GenerateConfig]:
    """Return the settings of the pools asked for by their folders."""
    if arguments.preset is None:
        return {arguments.pool: GenerateConfig(**vars(arguments.options))}
    from teasim.generation.presets import find_preset

    given = arguments.options
    filmed = {name: getattr(given, name) for name in ("cameras", "size", "quality", "look", "seed")}
    pools = find_preset(arguments.preset).items()
    return {arguments.pool / name: replace(config, **filmed) for name, config in pools}
