"""What is known of the segments of each demonstration besides their order."""

import numpy as np

from filtering.judging.decision.columns import largest
from filtering.judging.decision.observed import Observed
from teasim.common.arrays import Array

SHORT = -1.2
"""Log-duration over the usual one below which a segment counts as short."""


def segments(pool: Observed, n_labels: int) -> tuple[dict[str, Array], Array, Array]:
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


def other_evidence(pool: Observed) -> tuple[dict[str, Array], dict[str, Array]]:
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
