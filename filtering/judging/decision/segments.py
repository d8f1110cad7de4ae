"""What is known of the segments of each demonstration besides their order."""

import numpy as np

from filtering.judging.decision.columns import largest
from filtering.judging.decision.observed import Observed
from teasim.common.arrays import Array


def repetitions(pool: Observed, n_labels: int) -> Array:
    """Return (D, T): how often each demonstration does each step again."""
    times = [np.bincount(demo.labels, minlength=n_labels) for demo in pool.steps]
    return np.maximum(np.stack(times) - 1.0, 0.0)


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
        "told": nothing + pool.told,
        "reliability.absent": nothing + (pool.reliability is None),
        "reliability.unsure": unsure,
        "reliability.least": least,
        "effects.absent": nothing + (pool.ineffective is None),
        "effects.1": worst,
        "effects.2": second,
    }
    return columns, {"unsure": unsure, "ineffective": worst}
