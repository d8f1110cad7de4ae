"""Each demonstration beside the rest of its pool, and the pool as a whole."""

import numpy as np

from filtering.judging.decision.observed import Observed
from filtering.judging.norm.mixture import Populations
from filtering.judging.norm.norm_score import NormScore
from filtering.judging.norm.steps import StepCounts
from teasim.common.arrays import Array

ABSENT = 9.0
"""Distance to the next higher one for the highest demonstration [nats]."""


def distances(counts: StepCounts, pool: Observed) -> tuple[Array, Array]:
    """Return (D, D) how different two are in steps and order, and (D, D) 1 for equal lists."""
    first, second = np.triu_indices(counts.n_subtasks, 1)
    known, before = counts.both[:, first, second], counts.before[:, first, second]
    crossed = (before * known) @ ((1 - before) * known).T
    order = (crossed + crossed.T) / np.maximum(known @ known.T, 1)
    x = counts.occurs
    lacking = x @ (1 - x).T
    number = x.sum(axis=1)
    steps = (lacking + lacking.T) / np.maximum(number[:, None] + number[None], 1)
    lists: dict[tuple[int, ...], int] = {}
    kinds = np.array([lists.setdefault(demo.labels, len(lists)) for demo in pool.steps])
    return order + steps, (kinds[:, None] == kinds[None]).astype(np.float64)


def neighbours(near: Array, same: Array, trust: Array) -> dict[str, Array]:
    """Describe how near the most similar demonstrations are, and how many do just the same."""
    demos = len(trust)
    ordered = np.sort(near + ABSENT * np.eye(demos), axis=1)
    return {
        "near.1": ordered[:, 0],
        "near.2": ordered[:, min(1, demos - 2)],
        "near.quarter": ordered[:, min(demos - 2, max(1, demos // 4))],
        "same": (same - np.eye(demos)) @ trust,
        "plain.same": (same.sum(axis=1) - 1) / (demos - 1),
    }


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
    counts: StepCounts, near: Array, same: Array, score: NormScore, populations: Populations
) -> dict[str, float]:
    """Describe the pool as a whole."""
    demos, share, trust = len(near), counts.occurs.mean(axis=0), score.trust
    both = np.triu(counts.both.sum(axis=0), 1)
    p = ((counts.before * counts.both).sum(axis=0) / np.maximum(both, 1))[both > 1]
    bend = np.minimum(p, 1 - p)
    often = share >= 0.5
    kinds = same.argmax(axis=1)
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
        "pool.kinds": len(np.unique(kinds)) / demos,
        "pool.commonest": same.sum(axis=1).max() / demos,
        "pool.distance": near.sum() / (demos * (demos - 1)),
        "pool.trusted": trust.mean(),
        "pool.trusted distance": float(weights @ near @ weights),
        "pool.lack": populations.lack,
        "pool.norm": populations.norm.mean(),
    }
