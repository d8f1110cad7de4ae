"""How well effects are read, learned from labels, and how well missing ones are noticed without.

The labels of the pools are read for learning (TRAIN) and for counting only. Exit code 1 when the
mean balanced accuracy over the effects is below --at-least.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from filtering.effects.reader import balanced_accuracy, effect_states, fit_effects
from filtering.effects.rests import changes, look_at_rests
from filtering.effects.surprise import effect_surprises
from filtering.vision.frame_features import FrameSource
from teasim.common.parallel import default_jobs
from teasim.common.statistics import auroc
from teasim.pool import Pool

INVISIBLE = "stir"
"""Sub-task whose effect nothing shows at rest; it is printed, but not counted."""
NOTICED = 2.0
"""Surprise from which a demonstration counts as noticed [nats]."""


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--train", type=Path, help="pool whose labels are learned from")
    parser.add_argument("--test", type=Path, help="pool in which effects are read")
    parser.add_argument("--mistakes", type=Path, nargs="*", default=[], help="pools with mistakes")
    parser.add_argument("--cameras", nargs="+", default=["left", "cup"], help="cameras looked at")
    parser.add_argument("--at-least", type=float, default=0.0, help="balanced accuracy [percent]")
    parser.add_argument("--jobs", type=int, default=default_jobs(), help="processes")
    arguments = parser.parse_args()
    source = FrameSource(tuple(arguments.cameras))
    for root in arguments.mistakes:
        notice(Pool.open(root), source, arguments.jobs)
    if not arguments.train or not arguments.test:
        return 0
    pools = Pool.open(arguments.train), Pool.open(arguments.test)
    return int(100 * read(*pools, source, arguments.jobs) < arguments.at_least)


def read(train: Pool, test: Pool, source: FrameSource, jobs: int) -> float:
    """Print the balanced accuracy of each effect; return their mean."""
    reader = fit_effects(_rests(train, source, jobs), _names(train), source)
    said = np.vstack([reader.read(rests) for rests in _rests(test, source, jobs)])
    truth = np.vstack([effect_states(reader.effects, names)[1:] for names in _names(test)])
    found = balanced_accuracy(said > 0.5, truth > 0.5)
    print(f"{train.root.name} -> {test.root.name}, balanced accuracy (expected from its labels) %")
    for effect, share, expected in zip(reader.effects, found, reader.accuracies, strict=True):
        until = f" until {effect.undone_by}" if effect.undone_by else ""
        print(f"  {effect.subtask + until:30}{100 * share:6.1f}  ({100 * expected:.1f})")
    counted = [effect.subtask != INVISIBLE for effect in reader.effects]
    mean = float(found[counted].mean())
    print(f"  mean without {INVISIBLE:17}{100 * mean:6.1f}")
    return mean


def notice(pool: Pool, source: FrameSource, jobs: int) -> None:
    """Print how surprising the worst segment of demonstrations is, by what is wrong with them."""
    names = _names(pool)
    known = sorted({name for done in names for name in done})
    labels = [[known.index(name) for name in done] for done in names]
    rests = _rests(pool, source, jobs)
    worst = np.array([nats.max() for nats in effect_surprises([changes(r) for r in rests], labels)])
    kinds = np.array([_kind(pool, number) for number in range(len(worst))])
    print(f"{pool.root.name}, worst surprise of a demonstration without a label of an effect, nats")
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


def _rests(pool: Pool, source: FrameSource, jobs: int) -> list[np.ndarray]:
    segments = [episode.spans() for episode in pool.episodes]
    return look_at_rests(pool.episodes, segments, pool.fps, source, jobs=jobs)


def _names(pool: Pool) -> Sequence[Sequence[str]]:
    return [[span.subtask for span in episode.spans()] for episode in pool.episodes]


if __name__ == "__main__":
    sys.exit(main())
