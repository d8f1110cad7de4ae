"""Measure how well ineffective steps are noticed from the videos, without labels of effects.

The logged segments of the pools are used; labels of mistakes are read only for counting.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from filtering.effects.rests import changes, look_at_rests
from filtering.effects.surprise import effect_surprises
from filtering.vision.frame_features import FrameSource
from teasim.common.statistics import auroc
from teasim.common.workers import Workers, default_jobs
from teasim.pool import Pool

NOTICED = 2.0
"""Surprise above which a demonstration counts as noticed [nats]."""


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pools", type=Path, nargs="+", metavar="POOL", help="pools with mistakes")
    parser.add_argument("--cameras", nargs="+", default=["left", "cup"], help="cameras used")
    parser.add_argument("--jobs", type=int, default=default_jobs(), help="worker processes")
    arguments = parser.parse_args()
    source = FrameSource(tuple(arguments.cameras))
    for root in arguments.pools:
        notice(Pool.open(root), source, Workers(arguments.jobs))
    return 0


def notice(pool: Pool, source: FrameSource, workers: Workers) -> None:
    """Print the largest surprise of demonstrations by their mistakes."""
    names = _names(pool)
    known = sorted({name for done in names for name in done})
    labels = [[known.index(name) for name in done] for done in names]
    rests = _rests(pool, source, workers)
    worst = np.array([nats.max() for nats in effect_surprises([changes(r) for r in rests], labels)])
    kinds = np.array([_kind(pool, number) for number in range(len(worst))])
    print(f"{pool.root.name}, largest surprise of a demonstration, nats")
    for kind in sorted(set(kinds.tolist())):
        nats = worst[kinds == kind]
        both = kind != "correct" and "correct" in kinds
        compared = np.isin(kinds, (kind, "correct"))
        area = f"  AUROC {auroc(worst[compared], kinds[compared] == kind):.2f}" if both else ""
        noticed = f"{(nats > NOTICED).sum()} of {len(nats)} above {NOTICED:.0f}"
        print(f"  {kind:30}median {np.median(nats):5.2f}  {noticed}{area}")


def _kind(pool: Pool, number: int) -> str:
    record = pool.episodes[number].record
    if record is None or record.correct:
        return "correct"
    return " ".join(f"{m.name}@{m.subtask}" for m in record.mistakes[:1]) or record.sequence


def _rests(pool: Pool, source: FrameSource, workers: Workers) -> list[np.ndarray]:
    segments = [episode.spans() for episode in pool.episodes]
    return look_at_rests(pool.episodes, segments, pool.fps, source, workers=workers)


def _names(pool: Pool) -> Sequence[Sequence[str]]:
    return [[span.subtask for span in episode.spans()] for episode in pool.episodes]


if __name__ == "__main__":
    sys.exit(main())
