"""A sound copy of a data set of which some demonstrations are damaged; the source is not touched.

Demonstrations are numbered anew, as LeRobot needs it; their `demo_id` stays, so weight tables still
fit. What is damaged is set aside in the copy, never deleted.
"""

import shutil
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from teasim.common.errors import PoolError
from teasim.common.files import check_new_folder, sync, write_json
from teasim.pool.hub import located
from teasim.pool.integrity import check_episodes, check_pool
from teasim.pool.lerobot.episode import Episode
from teasim.pool.lerobot.reader import Pool
from teasim.pool.lerobot.soundness import Problem
from teasim.pool.lerobot.writing.rewriting import rewrite, write_rows

SET_ASIDE = "damaged"
"""Folder of the copy that holds what was damaged."""
REASONS = "reasons.json"
"""Why each demonstration was set aside."""


@dataclass(frozen=True)
class Repair:
    """What came of a repair."""

    root: Path
    """The sound copy."""
    kept: tuple[int, ...]
    """Numbers in the source of the demonstrations that were kept, in the order of the copy."""
    set_aside: dict[int, tuple[str, ...]]
    """Why each of the others was set aside, by its number in the source."""


def repair_pool(source: Path | str, target: Path | str) -> Repair:
    """Copy a LeRobot data set to the new folder `target`, with damaged demonstrations set aside.

    Raises:
        ConfigError: `target` is in use.
        PoolError: the damage is not that of single demonstrations, or none is sound.
    """
    target = Path(target)
    check_new_folder(target)
    pool = Pool.open(located(source))
    if target.resolve().is_relative_to(pool.root.resolve()):
        raise PoolError(f"The folder '{target}' lies in the pool itself; choose one outside it.")
    reasons = _reasons(check_episodes(pool))
    kept = tuple(e.index for e in pool.episodes if e.index not in reasons)
    if not kept:
        raise PoolError(f"No demonstration of '{pool.root}' is sound; nothing can be repaired.")
    building = target.with_name(f".{target.name}.tmp")
    shutil.rmtree(building, ignore_errors=True)
    try:
        building.mkdir(parents=True)
        rewrite(pool, kept, building)
        _set_aside(pool, reasons, building / SET_ASIDE)
        left = check_pool(building)
        if left:
            raise PoolError(f"The pool '{pool.root}' cannot be repaired: {left[0]}")
        if target.exists():
            target.rmdir()
        building.rename(target)
        sync(target.parent)
    finally:
        shutil.rmtree(building, ignore_errors=True)
    return Repair(target, kept, reasons)


def _reasons(problems: Sequence[Problem]) -> dict[int, tuple[str, ...]]:
    """The problems of each damaged demonstration."""
    reasons: dict[int, tuple[str, ...]] = {}
    for problem in problems:
        if problem.episode is not None:
            reasons[problem.episode] = (*reasons.get(problem.episode, ()), problem.text)
    return dict(sorted(reasons.items()))


def _files(episode: Episode) -> list[Path]:
    """Its log and videos, as far as the metadata tell where they are."""
    try:
        return [episode.data_path, *episode.video_files().values()]
    except PoolError:
        return []


def _set_aside(pool: Pool, reasons: dict[int, tuple[str, ...]], folder: Path) -> None:
    """Copy the files of damaged demonstrations that no sound one uses, their rows, and say why."""
    if not reasons:
        return
    used = {path for e in pool.episodes if e.index not in reasons for path in _files(e)}
    for episode in pool.episodes:
        if episode.index not in reasons:
            continue
        for path in _files(episode):
            if path not in used and path.is_file():
                copy = folder / path.relative_to(pool.root)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, copy)
        with suppress(PoolError):  # a log that is not readable was copied whole
            write_rows(episode, folder / "rows" / f"episode_{episode.index:06d}.parquet")
    described = [
        {"episode_index": index, "problems": list(texts)} for index, texts in reasons.items()
    ]
    write_json(folder / REASONS, {"source": str(pool.root), "episodes": described})
