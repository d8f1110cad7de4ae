"""Segments that change less than is usual: all the motion of a sub-task and nothing came of it.

No label of an effect is needed. The other demonstrations say what a segment of this sub-task
usually changes after the same sub-tasks, m, the median of their changes, and how changes scatter
about it, C: sugar in an empty cup is another sight than sugar in tea. A segment's change x has then

    a = (m' C^-1 x) / (m' C^-1 m)               of the usual effect, 1 when it is there, 0 when not,

and with s, the scatter of a in this sub-task, the excess of "nothing came of it", N(0, s^2), over
"it is as usual", N(1, s^2), in log-likelihood is

    (1 - 2 a) / (2 s^2)    nats, not below 0.

A sub-task without a visible effect has a large s, so that it accuses nobody. Medians everywhere: a
minority of demonstrations in which it failed does not become what is usual.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from sklearn.covariance import ledoit_wolf
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.effects.rests import change_scales

Array = NDArray[np.float64]

COMPONENTS = 32
"""Most main directions of the pool's changes that are looked at."""
SPREAD_FLOOR = 0.15
"""Least scatter of usual effects [usual effects]."""
SPREAD_PRIOR, PRIOR_DEMOS = 0.5, 2.0
"""Scatter that is assumed before any demonstration is seen, and how many it counts for."""
FEWEST_OTHERS = 2
"""With fewer other demonstrations that show a step nobody knows what is usual."""
FAR = 2.0
"""A change that is further off than this many medians counts as this far in the scatter C."""


def effect_surprises(changes: Sequence[Array], labels: Sequence[Sequence[int]]) -> list[Array]:
    """Return per demonstration (q,): how surprising each segment's lack of effect is [nats].

    Args:
        changes: per demonstration (q, F), what each segment changed, see `rests.changes`.
        labels: per demonstration the q sub-task labels of its segments, any whole numbers.
    """
    lengths = [len(rows) for rows in changes]
    demos = np.repeat(np.arange(len(changes)), lengths)
    steps = _steps(labels)
    with threadpool_limits(limits=1, user_api="blas"):
        amounts = effect_amounts(_main_directions(np.vstack(changes)), steps, demos)
    nats = np.zeros(len(amounts))
    for row in np.flatnonzero(np.isfinite(amounts)):
        others = amounts[(steps == steps[row]) & (demos != demos[row])]
        # The opposite of the usual effect is no more than none of it.
        nats[row] = (1 - 2 * max(amounts[row], 0.0)) / (2 * _spread(others) ** 2)
    return np.split(np.maximum(nats, 0.0), np.cumsum(lengths)[:-1])


def effect_amounts(changes: Array, steps: NDArray[np.int64], demos: NDArray[np.int64]) -> Array:
    """Return (S,): a, how much of the usual effect each segment had; NaN where none is known.

    Args:
        changes: (S, K) what the segments of all demonstrations changed.
        steps: (S,) equal numbers for those that can be compared.
        demos: (S,) demonstration of each.
    """
    usual = np.full(changes.shape, np.nan)
    for row in range(len(changes)):
        others = (steps == steps[row]) & (demos != demos[row])
        if len(np.unique(demos[others])) >= FEWEST_OTHERS:
            usual[row] = np.median(changes[others], axis=0)
    known = np.isfinite(usual).all(axis=1)
    amounts = np.full(len(changes), np.nan)
    for demo in np.unique(demos[known]):
        own = known & (demos == demo)
        others = known & (demos != demo)
        weighted = usual[own] @ _precision((changes - usual)[others])
        strength = (weighted * usual[own]).sum(axis=1)
        seen = (weighted * changes[own]).sum(axis=1)
        # A sub-task that never changes anything had all of its effect.
        amounts[own] = np.divide(seen, strength, out=np.ones(len(seen)), where=strength > 0)
    return amounts


def _steps(labels: Sequence[Sequence[int]]) -> NDArray[np.int64]:
    """Number all segments (S,): equal for one sub-task after the same ones."""
    keys = [(label, frozenset(demo[:k])) for demo in labels for k, label in enumerate(demo)]
    numbers = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    return np.array([numbers[key] for key in keys], dtype=np.int64)


def _main_directions(changes: Array) -> Array:
    """Return changes (S, F), each feature in its scale over the pool, as (S, K); 0 stays 0."""
    left, strength, _ = np.linalg.svd(changes / change_scales(changes), full_matrices=False)
    components: Array = (left * strength)[:, :COMPONENTS]
    return components


def _precision(residuals: Array) -> Array:
    """Return C^-1 (K, K) from deviations (S, K); far ones are drawn in."""
    norms = np.linalg.norm(residuals, axis=1)
    reach = FAR * np.median(norms)
    if not reach > 0:
        return np.eye(residuals.shape[1])
    inner = residuals * np.minimum(1.0, reach / np.maximum(norms, reach * 1e-9))[:, None]
    covariance, _ = ledoit_wolf(inner, assume_centered=True)
    precision: Array = np.linalg.pinv(covariance)
    return precision


def _spread(amounts: Array) -> float:
    """Return s from the amounts of the other demonstrations: their scatter about 1, and a prior."""
    known = amounts[np.isfinite(amounts)]
    scatter = 1.4826 * float(np.median(np.abs(known - 1.0))) if len(known) else 0.0
    shrunk = (PRIOR_DEMOS * SPREAD_PRIOR**2 + len(known) * scatter**2) / (PRIOR_DEMOS + len(known))
    return float(np.sqrt(SPREAD_FLOOR**2 + shrunk))
