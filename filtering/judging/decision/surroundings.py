"""Each demonstration beside the rest of its pool, and the pool as a whole."""

from dataclasses import dataclass

import numpy as np

from filtering.judging.decision.columns import largest
from filtering.judging.decision.observed import Observed
from filtering.judging.norm.mixture import Populations
from filtering.judging.norm.norm_score import NormScore
from filtering.judging.norm.steps import StepCounts
from teasim.common.arrays import Array

ABSENT = 9.0
"""Distance to the next higher one for the highest demonstration [nats]."""


@dataclass(frozen=True)
class Likeness:
    """What two of D demonstrations have in common."""

    near: Array
    """(D, D) how different they are in steps and order."""
    lists: Array
    """(D, D) 1 where both do the same steps in the same order, as often."""
    steps: Array
    """(D, D) 1 where both do the same steps."""
    order: Array
    """(D, D) 1 where no two steps are in one order in one and in the other order in the other; 0
    where steps are done in turns."""


def likeness(counts: StepCounts, pool: Observed) -> Likeness:
    """Compare every two demonstrations of a pool."""
    first, second = np.triu_indices(counts.n_subtasks, 1)
    known, before = counts.both[:, first, second], counts.before[:, first, second]
    crossed = (before * known) @ ((1 - before) * known).T
    crossed = crossed + crossed.T
    x = counts.occurs
    lacking = x @ (1 - x).T
    lacking = lacking + lacking.T
    number = x.sum(axis=1)
    away = crossed / np.maximum(known @ known.T, 1)
    away += lacking / np.maximum(number[:, None] + number[None], 1)
    lists: dict[tuple[int, ...], int] = {}
    kinds = np.array([lists.setdefault(demo.labels, len(lists)) for demo in pool.steps])
    return Likeness(
        near=away,
        lists=(kinds[:, None] == kinds[None]).astype(np.float64),
        steps=(lacking == 0).astype(np.float64),
        order=(crossed == 0).astype(np.float64),
    )


def neighbours(alike: Likeness, trust: Array) -> dict[str, Array]:
    """Describe how near the most similar demonstrations are, and those that are all alike."""
    demos = len(trust)
    ordered = np.sort(alike.near + ABSENT * np.eye(demos), axis=1)
    kept = alike.order.mean(axis=1)
    pool = {"most": kept.max(), "median": np.median(kept), "least": kept.min()}
    nearest = {
        "near.1": ordered[:, 0],
        "near.2": ordered[:, min(1, demos - 2)],
        "near.quarter": ordered[:, min(demos - 2, max(1, demos // 4))],
        "same": (alike.lists - np.eye(demos)) @ trust,
        "kept": kept,
    }
    nearest |= {f"kept: {what}": np.full(demos, value) for what, value in pool.items()}
    return nearest | camps("lists", alike.lists) | camps("steps", alike.steps)


def camps(name: str, alike: Array) -> dict[str, Array]:
    """Describe groups of demonstrations that are all alike.

    Args:
        name: in what they are alike.
        alike: (D, D) 1 where two are; if a and b are, and b and c, so are a and c.
    """
    demos = len(alike)
    sizes, first = alike.sum(axis=1), alike.argmax(axis=1)
    every = sizes[np.unique(first)]
    most = largest(every[None], 3)[0] / demos
    columns = {
        "own": sizes / demos,
        "larger": (every[None] > sizes[:, None]).sum(axis=1),
        "lead": sizes / demos - most[0],
    }
    pool = {
        **dict(zip(("largest", "second", "third"), most, strict=True)),
        "others": 1 - most.sum(),
        "number": len(every) / demos,
    }
    columns |= {what: np.full(demos, value) for what, value in pool.items()}
    return {f"{name}: {what}": number for what, number in columns.items()}


def context(name: str, values: Array) -> dict[str, Array]:
    """Put values (D,) beside those of the rest of the pool."""
    demos, order = len(values), np.sort(values)
    quartiles = np.interp(np.array([0.25, 0.5, 0.75]) * (demos - 1), np.arange(demos), order)
    below, above = np.searchsorted(order, values), np.searchsorted(order, values, "right")
    lower = order[np.maximum(below - 1, 0)]
    higher = np.where(above < demos, order[np.minimum(above, demos - 1)], values + ABSENT)
    spread = quartiles[2] - quartiles[0] + 0.25
    columns = {
        "rank": (below + above) / (2 * demos),
        "deviation": (values - quartiles[1]) / spread,
        "gap": values - lower,
        "next": higher - values,
    }
    pool = (*quartiles, order[-1])
    whole = {f"quartile {k}": np.full(demos, value) for k, value in enumerate(pool, start=1)}
    return {f"{name}: {what}": number for what, number in (columns | whole).items()}


def whole(
    counts: StepCounts, near: Array, score: NormScore, populations: Populations
) -> dict[str, float]:
    """Describe the pool as a whole."""
    demos, share, trust = len(near), counts.occurs.mean(axis=0), score.trust
    both = np.triu(counts.both.sum(axis=0), 1)
    p = ((counts.before * counts.both).sum(axis=0) / np.maximum(both, 1))[both > 1]
    bend = np.minimum(p, 1 - p)
    often = share >= 0.5
    weights = trust / trust.sum()
    return {
        "pool.demonstrations": np.log(demos),
        "pool.steps": often.sum(),
        "pool.labels": len(share),
        "pool.doubt": (4 * p * (1 - p)).mean() if len(p) else 0.0,
        "pool.unanimous": (bend <= 0).mean() if len(p) else 1.0,
        "pool.seldom bent": ((bend > 0) & (bend <= 1.5 / demos)).mean() if len(p) else 0.0,
        "pool.always": (share >= 1).sum() / max(often.sum(), 1),
        "pool.omitted": ((1 - share) * often).sum(),
        "pool.rare": (share * ~often).sum(),
        "pool.distance": near.sum() / (demos * (demos - 1)),
        "pool.trusted": trust.mean(),
        "pool.trusted distance": float(weights @ near @ weights),
        "pool.lack": populations.lack,
        "pool.norm": populations.norm.mean(),
    }
