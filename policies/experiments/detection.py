"""How well a filter tells incorrect demonstrations from correct ones, over one pool or many."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from teasim.common.statistics import Rate, auroc, grouped_rate, widest


@dataclass(frozen=True)
class Judged:
    """What was said about the D demonstrations of a pool, and the truth."""

    names: tuple[str, ...]
    """(D,) identity of each demonstration; pools may share demonstrations."""
    wrong: tuple[bool, ...]
    """(D,) which are incorrect."""
    flagged: tuple[bool, ...]
    """(D,) which were called incorrect."""
    losses: tuple[float, ...]
    """(D,) higher is worse; only their order counts."""
    probabilities: tuple[float, ...] | None = None
    """(D,) said probability of being incorrect; None where none was said."""

    @classmethod
    def from_json(cls, saved: dict[str, Any]) -> Self:
        """Return what `dataclasses.asdict` and JSON made of it."""
        fields: dict[str, Any] = {
            name: None if values is None else tuple(values) for name, values in saved.items()
        }
        return cls(**fields)


@dataclass(frozen=True)
class DetectionScores:
    """Scores over pools; incorrect demonstrations are the positives.

    Pools that are drawn from one bank share demonstrations, and a demonstration that is judged
    wrongly once is likely to be so again. An interval therefore is the wider one of two: with each
    pool, and with each demonstration, as a group of correlated trials.
    """

    pools: int
    """Number of pools."""
    true_positives: int
    """Incorrect demonstrations that are flagged."""
    false_positives: int
    """Correct demonstrations that are flagged."""
    false_negatives: int
    """Incorrect demonstrations that are not flagged."""
    true_negatives: int
    """Correct demonstrations that are not flagged."""
    accuracy: Rate
    """Share of all demonstrations that are judged rightly."""
    recall: Rate
    """Share of the incorrect demonstrations that are flagged."""
    false_alarms: Rate
    """Share of the correct demonstrations that are flagged."""
    precision: Rate
    """Share of the flagged demonstrations that are incorrect."""
    auroc: float
    """Mean over the pools that hold both kinds; nan without one."""
    brier: float
    """Mean squared error of the said probabilities; nan where none were said."""

    @property
    def f1(self) -> float:
        """2 TP / (2 TP + FP + FN); nan where nothing is flagged or to be flagged."""
        errors = self.false_positives + self.false_negatives
        hits = 2 * self.true_positives
        return hits / (hits + errors) if hits + errors else math.nan


def detection_scores(pools: Sequence[Judged]) -> DetectionScores:
    """Return the scores over one or more pools."""
    pairs = [pair for pool in pools for pair in zip(pool.wrong, pool.flagged, strict=True)]
    both = [pool for pool in pools if len(set(pool.wrong)) == 2]
    areas = [auroc(pool.losses, pool.wrong) for pool in both]
    errors = [
        (p - float(wrong)) ** 2
        for pool in pools
        for p, wrong in zip(pool.probabilities or (), pool.wrong, strict=bool(pool.probabilities))
    ]
    return DetectionScores(
        pools=len(pools),
        true_positives=pairs.count((True, True)),
        false_positives=pairs.count((False, True)),
        false_negatives=pairs.count((True, False)),
        true_negatives=pairs.count((False, False)),
        accuracy=_rate(pools, lambda wrong, flagged: (True, wrong == flagged)),
        recall=_rate(pools, lambda wrong, flagged: (wrong, flagged)),
        false_alarms=_rate(pools, lambda wrong, flagged: (not wrong, flagged)),
        precision=_rate(pools, lambda wrong, flagged: (flagged, wrong)),
        auroc=float(np.mean(areas)) if areas else math.nan,
        brier=float(np.mean(errors)) if errors else math.nan,
    )


def told_how_many(losses: NDArray[np.float64], count: int) -> NDArray[np.bool_]:
    """Return (D,): the `count` demonstrations of the largest losses (D,), the first of equal ones.

    This is the decision of baselines that have none of their own, which makes them look better than
    a filter that is not told how many demonstrations are incorrect.
    """
    flagged = np.zeros(len(losses), dtype=bool)
    flagged[np.argsort(-losses, kind="stable")[:count]] = True
    return flagged


Trial = Callable[[bool, bool], tuple[bool, bool]]
"""From (incorrect, flagged) to (whether this is a trial, whether it is a hit)."""


def _rate(pools: Sequence[Judged], trial: Trial) -> Rate:
    """Return a rate with the wider of the intervals by pool and by demonstration."""
    by_pool: dict[int, list[int]] = {}
    by_demo: dict[str, list[int]] = {}
    for number, pool in enumerate(pools):
        for name, wrong, flagged in zip(pool.names, pool.wrong, pool.flagged, strict=True):
            counts, hit = trial(wrong, flagged)
            if counts:
                for group in (by_pool.setdefault(number, [0, 0]), by_demo.setdefault(name, [0, 0])):
                    group[0] += hit
                    group[1] += 1
    return widest(
        [
            grouped_rate([(hits, trials) for hits, trials in groups.values()])
            for groups in (by_pool, by_demo)
        ]
    )
