"""Measure detection in many pools drawn from a bank of rendered demonstrations.

The bank consists of the demonstrations of all POOLs. Each is segmented once and compared before and
after its segments, from its videos alone. Labels of the demonstrations are used only to draw pools
and to score the result; the filter does not read them.
"""

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from filtering.config import FilterConfig
from filtering.effects.rests import changes, look_at_rests
from filtering.effects.surprise import effect_surprises
from filtering.judging.baselines import BASELINES
from filtering.judging.evidence import Evidence
from filtering.judging.judges import Judgement, by_norm
from filtering.judging.norm.steps import StepList
from filtering.segmentation.segmenter import segmenter_named
from filtering.vision.frame_features import FrameSource
from teasim.common.statistics import auroc, wilson_interval
from teasim.common.workers import Workers
from teasim.pool import Pool, Span
from teasim.task.recipes import PRECEDENCE

SIZES = (1, 2, 4, 6, 8)
"""Numbers of demonstrations that are not Seq_1 beside ten that are (paper, tables 2 and 3)."""
THREE = (("seq_1", 6), ("seq_2", 4), ("seq_3", 2))
"""The paper's pool of three kinds."""
USUAL = FilterConfig()
LEGAL = tuple((before, name) for name, needed in PRECEDENCE.items() for before in needed)
"""Pairs (a, b): a has to come before b."""


@dataclass(frozen=True)
class Demo:
    """A demonstration of the bank."""

    spans: tuple[Span, ...]
    """Segments that the segmenter found."""
    changes: np.ndarray | None
    """(q, F) change of the picture in each segment; None without effects."""
    sequence: str
    """True order of its sub-tasks."""
    mistakes: frozenset[str]
    """True mistakes."""


@dataclass(frozen=True)
class Outcome:
    """Result of one pool."""

    judgement: Judgement
    """What the filter found."""
    wrong: np.ndarray
    """(D,) which demonstrations are incorrect."""

    @property
    def flagged(self) -> np.ndarray:
        """(D,) True for flagged demonstrations."""
        return self.judgement.grouping.flagged

    @property
    def found(self) -> int:
        """Number of incorrect demonstrations that are flagged."""
        return int((self.flagged & self.wrong).sum())

    @property
    def accused(self) -> int:
        """Number of correct demonstrations that are flagged."""
        return int((self.flagged & ~self.wrong).sum())


def bank(
    pools: Iterable[Path], segmenter: str, effects: bool, workers: Workers
) -> tuple[list[Demo], tuple[str, ...]]:
    """Segment all demonstrations; return them and the names of the sub-tasks."""
    demos: list[Demo] = []
    names: tuple[str, ...] = ()
    for path in pools:
        pool = Pool.open(path)
        found = segmenter_named(segmenter)(pool, workers=workers)
        names = found.subtasks
        source = FrameSource(pool.cameras)
        rests = [None] * len(pool.episodes)
        if effects:
            rests = look_at_rests(pool.episodes, found.spans, pool.fps, source, workers=workers)
        for episode, spans, rest in zip(pool.episodes, found.spans, rests, strict=True):
            record = episode.record
            if record is not None and episode.demo_id not in found.labelled:
                kinds = frozenset(mistake.name for mistake in record.mistakes)
                changed = None if rest is None else changes(rest)
                demos.append(Demo(spans, changed, record.sequence, kinds))
    return demos, names


class Draws:
    """Draws pools from the bank and judges them."""

    def __init__(
        self, demos: Sequence[Demo], subtasks: tuple[str, ...], arguments: argparse.Namespace
    ) -> None:
        """Keep the bank."""
        self.demos, self.subtasks, self.pools = demos, subtasks, arguments.pools
        self.told, self.decision = arguments.segmenter == "logged", arguments.decision

    def judge(
        self,
        kinds: Sequence[tuple[str, int]],
        row: int,
        config: FilterConfig = USUAL,
        times: int = 1,
    ) -> list[Outcome]:
        """Draw `count` demonstrations of each sequence; those after the first are incorrect."""
        outcomes = []
        for number in range(times * self.pools):
            rng = np.random.default_rng([row, number])
            drawn = [self._draw(kind, count, rng) for kind, count in kinds]
            wrong = np.repeat(
                [position > 0 for position in range(len(kinds))], list(map(len, drawn))
            )
            outcomes.append(self.outcome([demo for some in drawn for demo in some], wrong, config))
        return outcomes

    def outcome(
        self, demos: Sequence[Demo], wrong: np.ndarray, config: FilterConfig = USUAL
    ) -> Outcome:
        """Judge one pool."""
        known = Evidence(self.subtasks, tuple(demo.spans for demo in demos), told=self.told)
        changed = [demo.changes for demo in demos if demo.changes is not None]
        if changed:
            known = replace(known, ineffective=effect_surprises(changed, known.labels))
        return Outcome(by_norm(known, replace(config, decision=self.decision)), wrong)

    def _draw(self, kind: str, count: int, rng: np.random.Generator) -> list[Demo]:
        able = [demo for demo in self.demos if demo.sequence == kind and _plain(demo)]
        if len(able) < count:
            raise SystemExit(f"The bank has {len(able)} demonstrations of {kind}, not {count}.")
        return [able[index] for index in rng.choice(len(able), count, replace=False)]


def _plain(demo: Demo) -> bool:
    return not demo.mistakes - {"skip"}


def tables(draws: Draws) -> None:
    """Print all rows."""
    row = 0
    for kind in ("seq_3", "seq_2"):
        for k in SIZES:
            row += 1
            _print(f"10 seq_1 + {k} {kind}", draws.judge([("seq_1", 10), (kind, k)], row))
    for groups in ("3", "auto"):
        three = draws.judge(THREE, 20, FilterConfig(groups=groups))
        truth = np.repeat(range(3), [count for _, count in THREE])
        right = sum(bool((o.judgement.grouping.groups == truth).all()) for o in three)
        print(f"6 + 4 + 2, groups {groups}: exactly right in {_share(right, len(three))}")
    clean = draws.judge([("seq_1", 12)], 21, times=2)
    silent = sum(not o.flagged.any() for o in clean)
    print(f"12 seq_1: nothing flagged in {_share(silent, len(clean))}")
    for name, pairs in (("", ()), (", with precedence", LEGAL)):
        legal = draws.judge([("seq_1", 10), ("legal", 2)], 22, FilterConfig(precedence=pairs))
        accused = sum(o.found for o in legal)
        print(f"10 seq_1 + 2 legal{name}: legal ones flagged {_share(accused, 2 * len(legal))}")


def kinds_table(draws: Draws) -> None:
    """Print how well each mistake is separated from correct demonstrations."""
    kinds = sorted({kind for demo in draws.demos for kind in demo.mistakes})
    correct = [demo for demo in draws.demos if not demo.mistakes]
    areas: dict[str, list[float]] = {kind: [] for kind in kinds}
    areas_of_baselines: dict[str, list[float]] = {name: [] for name in BASELINES}
    for number in range(draws.pools):
        rng = np.random.default_rng([30, number])
        pool = [correct[i] for i in rng.choice(len(correct), 10, replace=False)]
        for kind in kinds:
            able = [demo for demo in draws.demos if kind in demo.mistakes]
            pool.append(able[rng.integers(len(able))])
        wrong = np.arange(len(pool)) >= 10
        losses = draws.outcome(pool, wrong).judgement.losses
        for position, kind in enumerate(kinds, start=10):
            chosen = [*range(10), position]
            areas[kind].append(auroc(losses[chosen], wrong[chosen]))
        steps = [_steps(demo, draws.subtasks) for demo in pool]
        for name, baseline in BASELINES.items():
            areas_of_baselines[name].append(auroc(baseline(steps), wrong))
    for kind in kinds:
        print(f"{kind:16} AUROC {np.mean(areas[kind]):.3f}")
    print(f"{'macro':16} AUROC {np.mean([np.mean(a) for a in areas.values()]):.3f}")
    for name, found in areas_of_baselines.items():
        print(f"{name:16} AUROC {np.mean(found):.3f}  (all kinds together, a baseline)")


def _steps(demo: Demo, subtasks: tuple[str, ...]) -> StepList:
    return StepList(
        tuple(subtasks.index(span.subtask) for span in demo.spans),
        tuple(span.stop - span.start for span in demo.spans),
    )


def _print(name: str, outcomes: Sequence[Outcome]) -> None:
    wrong = sum(int(o.wrong.sum()) for o in outcomes)
    found, accused = sum(o.found for o in outcomes), sum(o.accused for o in outcomes)
    area = np.mean([auroc(o.judgement.losses, o.wrong) for o in outcomes])
    accuracy = np.mean([(o.flagged == o.wrong).mean() for o in outcomes])
    print(
        f"{name:20} AUROC {area:.3f}  found {_share(found, wrong)}  "
        f"accused per pool {accused / len(outcomes):.2f}  accuracy {100 * accuracy:.1f} %"
    )


def _share(hits: int, trials: int) -> str:
    low, high = wilson_interval(hits, trials)
    return f"{hits} of {trials} ({100 * low:.0f}-{100 * high:.0f} %)"


TABLES: dict[str, Callable[[Draws], None]] = {"orders": tables, "kinds": kinds_table}


def main() -> int:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bank", nargs="+", type=Path, metavar="POOL")
    parser.add_argument("--segmenter", required=True, help="logged, clustering or a folder")
    parser.add_argument("--decision", default="clusters", help="clusters or learned")
    parser.add_argument("--table", choices=TABLES, default="orders")
    parser.add_argument("--no-effects", action="store_true", help="use the steps alone")
    parser.add_argument("--pools", type=int, default=30, help="random pools per row")
    parser.add_argument("--jobs", type=int, default=1, help="worker processes")
    arguments = parser.parse_args()
    effects = not arguments.no_effects
    demos, subtasks = bank(arguments.bank, arguments.segmenter, effects, Workers(arguments.jobs))
    print(f"bank: {len(demos)} demonstrations")
    TABLES[arguments.table](Draws(demos, subtasks, arguments))
    return 0


if __name__ == "__main__":
    sys.exit(main())
