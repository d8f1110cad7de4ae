"""Is a pool what its metadata say? Every problem is one sentence that names the file."""

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from teasim.common.errors import PoolError
from teasim.pool.clips import check_decodable, probe
from teasim.pool.lerobot.describing.metadata import require_pool_folder
from teasim.pool.lerobot.episode import Episode
from teasim.pool.lerobot.reader import Pool
from teasim.pool.lerobot.soundness import Problem, sentences
from teasim.pool.source import Clip


def check_pool(path: Path | str) -> list[str]:
    """Look for damage in a pool.

    Files whose check sum is known are compared with it; other videos are decoded in full.

    Returns:
        One sentence per problem; empty when the pool is sound.

    Raises:
        PoolError: There is no pool at `path` at all.
    """
    root = Path(path)
    require_pool_folder(root)
    try:
        pool = Pool.open(root)
    except PoolError as error:
        return [str(error)]
    return list(dict.fromkeys(problem.text for problem in check_episodes(pool)))


def check_episodes(pool: Pool) -> list[Problem]:
    """Return the damage of an open pool, with the demonstrations it is in.

    What `teasim.pool.lerobot.soundness` finds comes first; the pictures of demonstrations that
    are sound so far are decoded.
    """
    problems = list(pool.findings().problems)
    for check in (_check_pictures, _check_identities):
        damaged = {problem.episode for problem in problems}
        problems += check(pool, [e for e in pool.episodes if e.index not in damaged])
    return list(dict.fromkeys(problems))


def _check_pictures(pool: Pool, episodes: Sequence[Episode]) -> Iterator[Problem]:
    """Does every picture decode? A video of several demonstrations is decoded once."""
    unchanged = {pool.root / name for name in pool.manifest.get("sha256", {})}
    told: dict[Path, list[str]] = {}
    for camera in pool.cameras:
        for episode in episodes:
            clip = episode.clip(camera)
            if not episode.has_video(camera):
                found = list(sentences(partial(_check_images, clip)))
            elif clip.path not in told and clip.path not in unchanged:
                found = told[clip.path] = list(sentences(partial(_check_file, clip.path)))
            else:
                found = told.get(clip.path, [])
            found = found or list(sentences(partial(_check_ends, clip)))
            yield from (Problem(text, episode.index) for text in found)


def _check_file(path: Path) -> Iterator[str]:
    decoded, stored = check_decodable(path), probe(path).n_frames
    if decoded < stored:
        yield f"The video '{path}' is damaged: {decoded} of its {stored} frames can be decoded."


def _check_ends(clip: Clip) -> Iterator[str]:
    """Are the first and the last frame found at their times?"""
    clip.frames([0, clip.length - 1])
    yield from ()


def _check_images(clip: Clip) -> Iterator[str]:
    for _ in clip.stream(np.arange(clip.length)):
        yield from ()


def _check_identities(pool: Pool, episodes: Sequence[Episode]) -> Iterator[Problem]:
    """Is each demonstration the one its stored identity was made from?"""
    del pool
    for episode in episodes:
        yield from (Problem(text, episode.index) for text in sentences(episode.check_identity))
