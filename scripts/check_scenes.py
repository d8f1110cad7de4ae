"""Judge pools drawn from the scenes by the default filter, and count what is right.

The truth is read for counting only. Scenes that are kept back are judged with --held-back alone,
when everything has been chosen. A folder that make_scenes.py did not write is made first. Pools of
mistakes have 10 usual videos and some of one kind of mistake; clean and free-order pools 12. Of an
optional step either way is that of a third or more: what fewer do cannot be told from a mistake.
With --tea pools of tea-making are judged too, with --scenes and no name after it they alone.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scenes.parts.writing import make_bank
from scenes.registry import HELD_BACK, SCENES, TUNED_ON
from scenes.scene import MISTAKES

from filtering import DemoFilter, FilterConfig
from teasim.common.statistics import auroc
from teasim.common.workers import Workers
from teasim.pool import Pool
from teasim.pool.lerobot import Episode
from teasim.pool.views.part import Part

GOOD, CLEAN = 10, 12
"""Usual videos of a pool with mistakes, and videos of a pool without."""
USUAL_SHARE = 1 / 3
"""Least share of a pool that does, or does without, an optional step."""
MOST_TRIES = 1000
"""Most pools drawn until one is found in which optional steps are usual."""
NEAR = 1.5
"""How far a place that is named may lie from the true one [s]."""
TEA_KINDS = {"seq_1": "usual", "legal": "free", "seq_2": "out_of_order", "seq_3": "missing"}
"""Kind of a video of tea-making by the order of its sub-tasks."""


@dataclass(frozen=True)
class Bank:
    """Videos to draw pools from."""

    name: str
    """Of the scene."""
    pool: Pool
    """The pool they are from."""
    episodes: list[Episode]
    """The videos."""
    cameras: tuple[str, ...]
    """The cameras that are used."""
    kinds: np.ndarray
    """(n,) the kind of each."""
    shown: np.ndarray
    """(n, O) True for the optional steps of each."""


class Drawn(NamedTuple):
    """A pool that was drawn."""

    kind: str
    """Kind of its mistakes, or usual or free."""
    videos: list[int]
    """Numbers in the bank."""
    bad: np.ndarray
    """(D,) True for incorrect ones."""

    @property
    def label(self) -> str:
        """What the pool is made of."""
        return f"{self.kind} {GOOD}+{self.bad.sum()}" if self.bad.any() else self.kind


def main() -> int:
    """Run the check."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, help="where the videos of the scenes are")
    parser.add_argument("--held-back", action="store_true", help="judge the scenes kept back")
    parser.add_argument("--scenes", nargs="*", help="names of scenes, in place of all tuned on")
    parser.add_argument("--tea", type=Path, nargs="*", default=[], help="pools of tea-making")
    parser.add_argument("--cameras", nargs="+", help="cameras of tea-making; default: all")
    parser.add_argument("--pools", type=int, default=4, help="pools per scene and kind")
    parser.add_argument("--bad", type=int, nargs="+", default=[3], help="incorrect ones per pool")
    parser.add_argument("--share", type=float, default=1.0, help="share of the videos drawn from")
    parser.add_argument("--score", default="auto", help="score of the filter")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=1, help="processes that look at videos")
    arguments = parser.parse_args()
    chosen = [s.name for s in (HELD_BACK if arguments.held_back else TUNED_ON)]
    print(f"{'scene':10}{'kind':18}{'AUROC':>7}{'found':>8}{'accused':>9}{'silent':>8}{'place':>7}")
    for name in arguments.scenes if arguments.scenes is not None else chosen:
        pool = make_bank(
            arguments.folder / name, SCENES[name], seed=0, workers=Workers(arguments.jobs)
        )
        judge(bank_of(name, pool, pool.cameras, arguments), arguments)
    for root in arguments.tea:
        pool = Pool.open(root)
        judge(bank_of("tea", pool, arguments.cameras or pool.cameras, arguments), arguments)
    return 0


def bank_of(name: str, pool: Pool, cameras: Sequence[str], arguments: argparse.Namespace) -> Bank:
    """Take the first videos of each kind of a pool."""
    kinds = np.array([kind_of(episode.record) for episode in pool.episodes])
    chosen = np.sort(
        np.concatenate(
            [
                those[: round(arguments.share * len(those))]
                for those in (np.flatnonzero(kinds == kind) for kind in np.unique(kinds))
            ]
        )
    )
    episodes = [pool.episodes[number] for number in chosen]
    optional = SCENES[name].optional if name in SCENES else ()
    shown = [{span.subtask for span in episode.spans()} for episode in episodes]
    does = np.array([[step in steps for step in optional] for steps in shown], dtype=bool)
    return Bank(name, pool, episodes, tuple(cameras), kinds[chosen], does)


def kind_of(record) -> str:
    """Return the kind of a video from what is known about it."""
    told = [m.name for m in record.mistakes if m.name in MISTAKES]
    return told[0] if told else TEA_KINDS.get(record.sequence, record.sequence)


def judge(bank: Bank, arguments: argparse.Namespace) -> None:
    """Print one line per kind of pool."""
    rows: dict[str, list[dict[str, float]]] = {}
    for drawn in draw(bank, arguments):
        part = Part(bank.pool, [bank.episodes[v] for v in drawn.videos])
        config = FilterConfig(score=arguments.score, cameras=bank.cameras)
        fitted = DemoFilter(config).fit(part, workers=Workers(arguments.jobs))
        rows.setdefault(drawn.label, []).append(count(bank, drawn, fitted))
    for kind, counted in rows.items():
        mean = {key: _mean([row[key] for row in counted]) for key in counted[0]}
        if kind in ("usual", "free"):
            line = f"{'':15}{mean['accused']:>9.2f}{mean['silent']:>8.2f}"
        else:
            line = (
                f"{mean['auroc']:>7.3f}{mean['found']:>8.2f}{mean['accused']:>9.2f}{'':8}"
                f"{mean['place']:>7.2f}"
            )
        print(f"{bank.name:10}{kind:18}{line}", flush=True)


def draw(bank: Bank, arguments: argparse.Namespace) -> Iterator[Drawn]:
    """Draw pools of every kind there are videos of."""
    rng = np.random.default_rng(arguments.seed)
    usual = np.flatnonzero(bank.kinds == "usual")
    for kind in MISTAKES:
        those = np.flatnonzero(bank.kinds == kind)
        for bad in (number for number in arguments.bad if number <= len(those)):
            for _ in range(arguments.pools):
                if videos := _balanced(bank, [(usual, GOOD), (those, bad)], rng):
                    yield Drawn(kind, videos, bank.kinds[videos] == kind)
    for kind in ("usual", "free"):
        those = np.flatnonzero(bank.kinds == kind)
        for _ in range(arguments.pools if len(those) >= CLEAN // 2 else 0):
            if videos := _balanced(bank, [(those, CLEAN)], rng):
                yield Drawn(kind, videos, np.zeros(len(videos), dtype=bool))


def _balanced(
    bank: Bank, parts: Sequence[tuple[np.ndarray, int]], rng: np.random.Generator
) -> list[int]:
    """Draw videos until either way of every optional step is that of enough of them.

    Empty where there are no such videos: scenes with few legal orders have few free ones.
    """
    for _ in range(MOST_TRIES):
        videos = [int(v) for those, count in parts for v in rng.permutation(those)[:count]]
        does = bank.shown[videos].mean(axis=0)
        if (np.minimum(does, 1 - does) >= USUAL_SHARE).all():
            return videos
    return []


def count(bank: Bank, drawn: Drawn, fitted: DemoFilter) -> dict[str, float]:
    """Return what is right about the judgement of one pool."""
    bad, flagged = drawn.bad, fitted.flagged_
    right = [
        _place_is_right(bank, drawn, fitted, d)
        for d in np.flatnonzero(bad & flagged)
        if bank.episodes[drawn.videos[d]].record.mistakes
    ]
    return {
        "auroc": auroc(fitted.losses_, bad) if bad.any() else np.nan,
        "found": flagged[bad].mean() if bad.any() else np.nan,
        "accused": float(flagged[~bad].sum()),
        "silent": float(not flagged[~bad].any()),
        "place": float(np.mean(right)) if right else np.nan,
    }


def _mean(values: Sequence[float]) -> float:
    """Return the mean of what is known, NaN where nothing is."""
    known = [value for value in values if not np.isnan(value)]
    return float(np.mean(known)) if known else np.nan


def _place_is_right(bank: Bank, drawn: Drawn, fitted: DemoFilter, d: int) -> bool:
    """Tell whether the first finding of a demonstration lies at one of its mistakes."""
    first = fitted.findings_[d][0]
    shown = first.came or first.ineffective
    start, stop = (shown.start, shown.stop) if shown else (first.frame, first.frame)
    slack = NEAR * bank.pool.fps
    return any(
        start <= mistake.stop + slack and stop >= mistake.start - slack
        for mistake in bank.episodes[drawn.videos[d]].record.mistakes
    )


if __name__ == "__main__":
    sys.exit(main())
