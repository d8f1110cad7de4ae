"""Ineffective steps: segments with the motion of a sub-task that change less than usual.

No label of an effect is needed. Segments of the same sub-task after the same sub-tasks in the other
demonstrations give the usual change m, the median of their changes, and its scatter C. (They must
follow the same sub-tasks because sugar in an empty cup looks different from sugar in tea.) A change
x of a segment contains the share

    a = (m' C^-1 x) / (m' C^-1 m)

of the usual effect, 1 if it is complete, 0 if it is absent. With s, the scatter of a in this
sub-task, the log-likelihood ratio of "ineffective", N(0, s^2), to "as usual", N(1, s^2), is

    (1 - 2 a) / (2 s^2)    nats, not below 0.

For a sub-task without a visible effect s is large, so the ratio is small. Medians keep a minority
of ineffective steps from shifting the usual change.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from sklearn.covariance import ledoit_wolf
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.effects.rests import change_scales
from teasim.common.arrays import Array

COMPONENTS = 32
"""Largest number of principal components of the changes that are used."""
SPREAD_FLOOR = 0.15
"""Least scatter of a [usual effects]."""
SPREAD_PRIOR, PRIOR_DEMOS = 0.5, 2.0
"""Prior scatter of a [usual effects], and its weight [demonstrations]."""
FEWEST_OTHERS = 2
"""Least number of other demonstrations from which the usual change is taken."""
MAD_TO_DEVIATION = 1.4826
"""Standard deviation of a Gaussian [median absolute deviation]."""
FAR = 2.0
"""Deviations are clipped to this many median deviations for the scatter C."""


def effect_surprises(changes: Sequence[Array], labels: Sequence[Sequence[int]]) -> list[Array]:
    """Return per demonstration (q,): how surprising the lack of effect of each segment is [nats].

    Args:
        changes: per demonstration (q, F) change of each segment, see `rests.changes`.
        labels: per demonstration the q sub-task labels of its segments, any whole numbers.
    """
    lengths = [len(rows) for rows in changes]
    demos = np.repeat(np.arange(len(changes)), lengths)
    steps = number_steps(labels)
    with threadpool_limits(limits=1, user_api="blas"):
        amounts = effect_amounts(_main_directions(np.vstack(changes)), steps, demos)
    nats = np.zeros(len(amounts))
    for row in np.flatnonzero(np.isfinite(amounts)):
        others = amounts[(steps == steps[row]) & (demos != demos[row])]
        # The opposite of the usual effect counts as no effect.
        nats[row] = (1 - 2 * max(amounts[row], 0.0)) / (2 * spread_of(others) ** 2)
    return np.split(np.maximum(nats, 0.0), np.cumsum(lengths)[:-1])


def effect_amounts(changes: Array, steps: NDArray[np.int64], demos: NDArray[np.int64]) -> Array:
    """Return (S,): a, the share of the usual effect in each segment; NaN where it is not known.

    Args:
        changes: (S, K) changes of the segments of all demonstrations.
        steps: (S,) equal numbers for segments that can be compared.
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
        # A sub-task that never changes anything is always complete.
        amounts[own] = np.divide(seen, strength, out=np.ones(len(seen)), where=strength > 0)
    return amounts


def number_steps(labels: Sequence[Sequence[int]]) -> NDArray[np.int64]:
    """Number all segments (S,): equal for the same sub-task after the same sub-tasks."""
    keys = [(label, frozenset(demo[:k])) for demo in labels for k, label in enumerate(demo)]
    numbers = {key: number for number, key in enumerate(dict.fromkeys(keys))}
    return np.array([numbers[key] for key in keys], dtype=np.int64)


def _main_directions(changes: Array) -> Array:
    """Return the principal components (S, K) of scaled changes (S, F); 0 stays 0."""
    left, strength, _ = np.linalg.svd(changes / change_scales(changes), full_matrices=False)
    components: Array = (left * strength)[:, :COMPONENTS]
    return components


def _precision(residuals: Array) -> Array:
    """Return C^-1 (K, K) from deviations (S, K), clipped at FAR."""
    norms = np.linalg.norm(residuals, axis=1)
    reach = FAR * np.median(norms)
    if not reach > 0:
        return np.eye(residuals.shape[1])
    inner = residuals * np.minimum(1.0, reach / np.maximum(norms, reach * 1e-9))[:, None]
    covariance, _ = ledoit_wolf(inner, assume_centered=True)
    precision: Array = np.linalg.pinv(covariance)
    return precision


def spread_of(amounts: Array) -> float:
    """Return s from the amounts of the other demonstrations: their scatter about 1, and a prior."""
    known = amounts[np.isfinite(amounts)]
    scatter = MAD_TO_DEVIATION * float(np.median(np.abs(known - 1.0))) if len(known) else 0.0
    shrunk = (PRIOR_DEMOS * SPREAD_PRIOR**2 + len(known) * scatter**2) / (PRIOR_DEMOS + len(known))
    return float(np.sqrt(SPREAD_FLOOR**2 + shrunk))
