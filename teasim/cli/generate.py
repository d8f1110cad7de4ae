"""The verb `generate`: render a pool of demonstrations."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from teasim.common.errors import ConfigError
from teasim.common.parallel import default_jobs

if TYPE_CHECKING:
    from teasim.generation import GenerateConfig


@dataclass(frozen=True)
class GenerateArguments:
    """Render a pool of tea-making demonstrations, with mistakes in it when asked for."""

    pool: Annotated[Path, tyro.conf.Positional]
    """Folder to write; new or empty. An interrupted pool is continued by the same command."""
    seq1: int = 10
    """Demonstrations in the optimal order."""
    seq2: int = 0
    """Demonstrations in the sub-optimal order (tea bag late)."""
    seq3: int = 0
    """Incorrect demonstrations: one or two of tea bag, water and oven-off left out."""
    legal: int = 0
    """Correct demonstrations in a random order that respects what has to wait for what."""
    mistakes: tuple[str, ...] = ()
    """Further incorrect demonstrations, as NAME[@SUBTASK][+NAME...][:COUNT], e.g. skip@add_milk:2;
    skip, wrong_order, repeat, ineffective, wrong_object, abandoned."""
    optional: tuple[str, ...] = ()
    """Ingredients that half of the demonstrations do without, rightly: add_sugar, add_milk."""
    randomize: bool = True
    """Move and turn the things on the table in every demonstration; with --no-randomize each begins
    with everything in its nominal place."""
    match_length: bool = False
    """Draw out all demonstrations so that their length says nothing about them."""
    embodiment: str = "yumi"
    """Who demonstrates: yumi (with a joint log) or person (without)."""
    participants: int = 3
    """How many people take turns, 1 to 3."""
    preset: str | None = None
    """paper: the pools of the paper, 36 videos of people and 12 of YuMi, in two folders below POOL;
    the counts above are not used then."""
    cameras: tuple[str, ...] = ("left", "cup")
    """Cameras that film: left, cup, front, top."""
    size: int = 224
    """Width and height of the videos in pixels."""
    quality: str = "fast"
    """Look of the pictures: fast or nice."""
    look: str = "fixed"
    """fixed, or random: light, colours, camera poses and things around differ in every video."""
    seed: int = 0
    """Seed of everything random; the same seed gives the same files."""
    jobs: int = default_jobs()
    """Processes to work in; the result does not depend on it."""
    backend: str = "loky"
    """What runs the processes: loky, dask or ray."""


def main(argv: Sequence[str] | None = None) -> int:
    """Render a pool of tea-making demonstrations, with mistakes in it when asked for."""
    arguments = tyro.cli(GenerateArguments, prog="teasim generate", args=argv)
    pools = _pools(arguments)
    from teasim.generation import generate

    start = time.perf_counter()
    remade = count = 0
    for folder, config in pools.items():
        made = generate(folder, config, jobs=arguments.jobs, backend=arguments.backend)
        count, remade = count + len(made.pool.episodes), remade + made.remade
    seconds = time.perf_counter() - start
    print(
        f"{count} demonstrations in {arguments.pool} ({seconds:.0f} s, "
        f"{remade} made again because they did not come out as labelled)"
    )
    return 0


def _pools(arguments: GenerateArguments) -> dict[Path, GenerateConfig]:
    """The pools asked for by their folders, all checked before the first one is begun."""
    mistakes = parse_mistakes(arguments.mistakes)
    from teasim.generation import GenerateConfig
    from teasim.generation.presets import find_preset

    given = {field.name: getattr(arguments, field.name) for field in fields(GenerateConfig)}
    if arguments.preset is None:
        return {arguments.pool: GenerateConfig(**given | {"mistakes": mistakes})}
    filmed = {name: given[name] for name in ("cameras", "size", "quality", "look", "seed")}
    pools = find_preset(arguments.preset).items()
    return {arguments.pool / name: replace(config, **filmed) for name, config in pools}


def parse_mistakes(words: Sequence[str]) -> tuple[tuple[str, int], ...]:
    """Turn NAME[@SUBTASK][+NAME...][:COUNT] into counts.

    Raises:
        ConfigError: a count is not a number, or a name is given twice.
    """
    counts: dict[str, int] = {}
    for word in words:
        name, _, count = word.partition(":")
        if name in counts:
            raise ConfigError(f"The mistake '{name}' is given twice; write it once as NAME:COUNT.")
        if count and not count.isdecimal():
            raise ConfigError(
                f"'{word}' is no mistake with a count; write NAME[@SUBTASK][+NAME...][:COUNT]."
            )
        counts[name] = int(count or 1)
    return tuple(counts.items())
