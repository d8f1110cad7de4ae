"""A whole pool: every demonstration planned, made in parallel processes, and put together."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from teasim.common.parallel import run
from teasim.common.workers import IN_PROCESS, Workers
from teasim.generation.config import GenerateConfig
from teasim.generation.plan import plan_pool
from teasim.generation.recording import generate_demo, pool_header
from teasim.gl import choose_gl
from teasim.pool import Pool, claim_folder, episode_is_done, finalize_pool


@dataclass(frozen=True)
class Generated:
    """A finished pool and the number of attempts that were discarded."""

    pool: Pool
    """The pool."""
    remade: int
    """Demonstrations that were made again because they did not come out as labelled."""


def generate(
    root: Path | str, config: GenerateConfig, *, workers: Workers = IN_PROCESS
) -> Generated:
    """Make a pool in the folder `root`; an unfinished pool is resumed.

    Raises:
        ConfigError: no cluster answers at the address of the workers.
        PoolError: `root` is in use.
        GenerationError: a demonstration never came out as labelled.
        RenderError: no headless OpenGL back end works.
    """
    if config.video:
        choose_gl()  # fails before anything is written if nothing can be rendered
    plans = plan_pool(config)
    header = pool_header(config)
    claim_folder(Path(root), header)
    waiting = [plan for plan in plans if not episode_is_done(root, plan.index, header)]
    make = partial(generate_demo, Path(root), config)
    attempts = run(make, waiting, workers=workers, description="demonstrations")
    return Generated(finalize_pool(root, header, len(plans)), sum(attempts) - len(attempts))
