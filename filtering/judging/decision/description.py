"""The description of a pool that the network reads: columns of each demonstration, and of pairs.

Kinds of evidence that a pool lacks (reliability, effects) are masked: their columns are 0 and a
column says so.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from filtering.judging.decision.columns import Departures, departures, largest
from filtering.judging.decision.null import null_losses
from filtering.judging.decision.observed import Observed
from filtering.judging.norm.mixture import Populations, find_populations
from filtering.judging.norm.norm_score import NormScore, score_populations
from filtering.judging.norm.steps import StepCounts, count_steps
from teasim.common.arrays import Array

SHORT = -1.2
"""Log-duration over the usual one below which a segment counts as short."""
FAR = 2.0
"""Largest distance of two demonstrations that the network is shown."""
ABSENT = 9.0
"""Distance to the next higher one for the highest demonstration [nats]."""


@dataclass(frozen=True)
class Description:
    """A pool of D demonstrations as numbers."""

    rows: NDArray[np.float32]
    """(D, F) columns of each demonstration."""
    pairs: NDArray[np.float32]
    """(D, D, P) what two demonstrations have in common."""
    names: tuple[str, ...]
    """Names of the F columns."""


def describe(pool: Observed) -> Description:
    """Describe a pool of 3 or more demonstrations in canonical form."""
    n_labels = 1 + max(max(demo.labels) for demo in pool.steps)
    counts = count_steps(pool.steps, n_labels)
    populations = find_populations(counts)
    score = score_populations(counts, populations)
    near, same = _distances(counts, pool)
    segments, typical, repeats = _segments(pool, n_labels)
    trust = score.trust
    trusting = departures(counts, repeats, typical, near, trust)
    plain = departures(counts, repeats, typical, near, np.ones(len(trust)))
    columns = dict(trusting.columns)
    columns |= {f"plain.{name}": values for name, values in plain.columns.items()}
    columns |= segments | _neighbours(near, same, trust)
    columns |= {
        "systematic": score.systematic,
        "norm": populations.norm,
        "ratio": np.clip(populations.log_ratio, -30, 30),
        "trust": trust,
    }
    columns |= _above_null(null_losses(pool, counts, trust), trusting.columns["loss"])
    evidence, parts = _other_evidence(pool)
    columns |= evidence
    parts |= trusting.parts | {"length": segments["segments.ratio"], "score": score.losses}
    for name, values in parts.items():
        columns |= _context(name, values)
    for name in ("loss", "order.z", "omitted"):
        columns |= _context(f"plain.{name}", plain.parts[name])
    whole = _whole(counts, near, same, score, populations) | {
        f"pool.{name}": segments[name].mean() for name in segments
    }
    whole["pool.spread of length"] = segments["segments.ratio"].std()
    whole["pool.spread of time"] = segments["segments.total"].std()
    columns |= {name: np.full(len(trust), value) for name, value in whole.items()}
    rows = np.stack(list(columns.values()), axis=1).astype(np.float32)
    return Description(rows, _pairs(near, same, trusting, counts), tuple(columns))


def _distances(counts: StepCounts, pool: Observed) -> tuple[Array, Array]:
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


def _segments(pool: Observed, n_labels: int) -> tuple[dict[str, Array], Array, Array]:
    """Describe number and duration of segments; return also (T,) typical ones, (D, T) repeats."""
    times = [np.log(np.array(demo.lengths, float)) for demo in pool.steps]
    every, labels = np.concatenate(times), np.concatenate([demo.labels for demo in pool.steps])
    centre = np.median(every)
    typical = np.array([np.median(every[labels == label]) for label in range(n_labels)]) - centre
    repeats, rows = np.zeros((len(times), n_labels)), []
    total = np.array([np.log(np.exp(time).sum()) for time in times])
    for row, (demo, time) in enumerate(zip(pool.steps, times, strict=True)):
        ratio = time - centre - typical[list(demo.labels)]
        repeats[row] = np.maximum(np.bincount(demo.labels, minlength=n_labels) - 1, 0)
        worst = np.sort(ratio)[: max(1, len(ratio) // 6)].mean()
        rows.append([(ratio < SHORT).mean(), worst, ratio.max(), np.abs(ratio).mean()])
    short, shortest, longest, odd = np.array(rows).T
    number = np.array([len(demo.labels) for demo in pool.steps])
    distinct = number - repeats.sum(axis=1)
    columns = {
        "segments.number": number - np.median(number),
        "segments.ratio": number / np.median(number),
        "segments.distinct": distinct - np.median(distinct),
        "segments.repeats": repeats.sum(axis=1) / number,
        "segments.total": total - np.median(total),
        "segments.short": short,
        "segments.shortest": shortest,
        "segments.longest": longest,
        "segments.odd": odd,
    }
    return columns, typical, repeats


def _neighbours(near: Array, same: Array, trust: Array) -> dict[str, Array]:
    demos = len(trust)
    ordered = np.sort(near + ABSENT * np.eye(demos), axis=1)
    return {
        "near.1": ordered[:, 0],
        "near.2": ordered[:, min(1, demos - 2)],
        "near.quarter": ordered[:, min(demos - 2, max(1, demos // 4))],
        "same": (same - np.eye(demos)) @ trust,
        "plain.same": (same.sum(axis=1) - 1) / (demos - 1),
    }


def _above_null(null: Array, losses: Array) -> dict[str, Array]:
    """Compare losses (D,) with those of honest demonstrations."""
    most = np.quantile(null, 0.9 ** (1 / len(losses)))
    return {
        "null.z": (losses - null.mean()) / (null.std() + 0.5),
        "null.above": losses - most,
        "null.share": (null[None] >= losses[:, None]).mean(axis=1),
        "null.mean": np.full(len(losses), null.mean()),
        "null.spread": np.full(len(losses), null.std()),
    }


def _other_evidence(pool: Observed) -> tuple[dict[str, Array], dict[str, Array]]:
    """Describe reliability and effects, 0 where the pool has none; return columns and parts."""
    nothing = np.zeros(len(pool.steps))
    unsure, least, worst, second = nothing, nothing, nothing, nothing
    if pool.reliability is not None:
        unsure = np.array([1 - known.mean() for known in pool.reliability])
        least = np.array([1 - known.min() for known in pool.reliability])
    if pool.ineffective is not None:
        nats = np.array([largest(known[None], 2)[0] for known in pool.ineffective])
        worst, second = nats.T
    columns = {
        "reliability.absent": nothing + (pool.reliability is None),
        "reliability.unsure": unsure,
        "reliability.least": least,
        "effects.absent": nothing + (pool.ineffective is None),
        "effects.1": worst,
        "effects.2": second,
    }
    return columns, {"unsure": unsure, "ineffective": worst}


def _context(name: str, values: Array) -> dict[str, Array]:
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


def _whole(
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


def _pairs(near: Array, same: Array, found: Departures, counts: StepCounts) -> NDArray[np.float32]:
    """Return (D, D, P): distance, equality, and how alike the departures of two are."""
    rare = counts.occurs * np.maximum(0.5 - counts.occurs.mean(axis=0), 0)
    alike = [_alike(part) for part in (found.omitted, found.violated, rare)]
    return np.stack([np.minimum(near, FAR), same, *alike], axis=2).astype(np.float32)


def _alike(values: Array) -> Array:
    """Return (D, D): cosine of the departures of two, near 0 where one hardly departs."""
    flat = values.reshape(len(values), -1)
    flat = flat / np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 0.3)
    return np.asarray(flat @ flat.T)
