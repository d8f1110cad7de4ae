"""From weights to groups: clusters and the mid-points between them (paper section 3.3).

k-means is solved exactly, because it is one-dimensional; the Gaussian mixture and mini-batch
k-means are those of the paper. In the paper the number of groups is given. Here it can also be
chosen from the data; one group is possible, so that nothing is flagged in a clean pool.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from filtering.judging.kmeans import kmeans
from teasim.common.errors import ConfigError
from teasim.common.registry import named

GROUPS = ("auto", "1", "2", "3")
"""Numbers of groups that can be asked for."""
MIN_GAP = 0.5
"""Least distance between the mean weights of two groups [weight]. Set by judgement: half of the
range of weights."""
MIN_GAP_OF_THREE = 0.25
"""Least distance between neighbouring means of three groups [weight]. Half of MIN_GAP."""

DIGITS = 9
"""Decimal places to which weights and losses are compared."""
LEAST_VARIANCE = 1e-4
"""Least variance of a group of weights."""
LEAST_ROOT_VARIANCE = 0.05
"""Least variance of a group of sqrt(loss) [nats]; smaller differences are noise."""
NO_SPREAD = 1e-6
"""Values of sqrt(loss) that differ by less are equal [sqrt(nats)]."""


@dataclass(frozen=True)
class Grouping:
    """The groups of a pool's demonstrations."""

    groups: NDArray[np.int64]
    """(D,) group of each demonstration; 0 has the highest weights and is kept."""
    threshold: float
    """Weight below which a demonstration is flagged; 0 when none was found or asked for."""
    names: tuple[str, ...] = ()
    """What the groups have in common, in words; empty where only the weights define them."""

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """(D,) True for every demonstration outside group 0."""
        return self.groups > 0

    @property
    def count(self) -> int:
        """Number of groups."""
        return int(self.groups.max()) + 1


def group_weights(
    weights: NDArray[np.float64], groups: str = "auto", method: float | str = "kmeans"
) -> Grouping:
    """Split weights (D,) into groups and put the threshold between group 0 and group 1.

    There are fewer groups than asked for when there are fewer different weights.

    Args:
        weights: (D,) in [0, 1].
        groups: one of GROUPS; not used with a number as `method`.
        method: one of METHODS, or the threshold itself.

    Raises:
        ConfigError: `groups` or `method` is unknown, or there are fewer demonstrations than groups.
    """
    if not isinstance(method, str):
        return Grouping((weights < method).astype(np.int64), float(method))
    grouper = method_named(method)
    if groups not in GROUPS:
        raise ConfigError(f"Unknown number of groups '{groups}'; choose {', '.join(GROUPS)}.")
    weights = weights.round(DIGITS)
    if groups == "auto":
        return _chosen_from_data(weights, grouper)
    if int(groups) > len(weights):
        raise ConfigError(
            f"{groups} groups were asked for but there are only {len(weights)} demonstrations; "
            f"choose auto or at most {len(weights)}."
        )
    return grouper(weights, min(int(groups), len(np.unique(weights))))


def as_many_as_asked(grouping: Grouping, weights: NDArray[np.float64], groups: str) -> Grouping:
    """Return a grouping by nature, or one of weights (D,) if another number of groups is asked for.

    Raises:
        ConfigError: there are fewer demonstrations than groups.
    """
    if groups in ("auto", str(grouping.count)):
        return grouping
    return group_weights(weights, groups)


Grouper = Callable[[NDArray[np.float64], int], Grouping]
"""Splits weights (D,) into a number of groups, fewer where a group would be empty."""


def _chosen_from_data(weights: NDArray[np.float64], grouper: Grouper) -> Grouping:
    distinct = len(np.unique(weights))
    two = grouper(weights, min(2, distinct))
    if _smallest_gap(weights, two) < MIN_GAP:
        return grouper(weights, 1)
    if distinct < 3:
        return two
    three = grouper(weights, 3)
    clear = _smallest_gap(weights, three) >= MIN_GAP_OF_THREE
    better = _silhouette(weights, three) > _silhouette(weights, two)
    # A third group may refine the flagged ones, but must not take any from the kept ones.
    same_kept = np.array_equal(two.flagged, three.flagged)
    return three if clear and better and same_kept else two


def _by_kmeans(weights: NDArray[np.float64], count: int) -> Grouping:
    """Return the exact k-means solution; equal weights always share a group."""
    groups = kmeans(-weights, count)
    if count == 1:
        return Grouping(groups, 0.0)
    middle = (weights[groups == 0].mean() + weights[groups == 1].mean()) / 2
    # The mid-point of the means may lie inside a wide group: keep it between the groups.
    lowest_kept, highest_flagged = weights[groups == 0].min(), weights[groups == 1].max()
    inside = highest_flagged < middle <= lowest_kept
    return Grouping(groups, float(middle if inside else (lowest_kept + highest_flagged) / 2))


def _by_mixture(weights: NDArray[np.float64], count: int) -> Grouping:
    from sklearn.mixture import GaussianMixture

    model = GaussianMixture(
        count, means_init=_kmeans_means(weights, count), reg_covar=LEAST_VARIANCE, random_state=0
    )
    return _between(weights, model.fit(np.sort(weights)[:, None]).means_.ravel())


def _by_minibatch(weights: NDArray[np.float64], count: int) -> Grouping:
    from sklearn.cluster import MiniBatchKMeans

    model = MiniBatchKMeans(count, init=_kmeans_means(weights, count), n_init=1, random_state=0)
    return _between(weights, model.fit(np.sort(weights)[:, None]).cluster_centers_.ravel())


def _kmeans_means(weights: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    groups = _by_kmeans(weights, count).groups
    return np.array([[weights[groups == group].mean()] for group in range(count)])


def _between(weights: NDArray[np.float64], means: NDArray[np.float64]) -> Grouping:
    """Cut at the mid-points of the means; empty groups are dropped."""
    falling = np.sort(means)[::-1]
    middles = (falling[1:] + falling[:-1]) / 2
    below: NDArray[np.bool_] = weights[:, None] < middles[None, :]
    numbers = np.count_nonzero(below, axis=1)
    present, groups = np.unique(numbers, return_inverse=True)
    threshold = float(middles[present[1] - 1]) if len(present) > 1 else 0.0
    return Grouping(groups.astype(np.int64), threshold)


METHODS: Mapping[str, Grouper] = MappingProxyType(
    {"kmeans": _by_kmeans, "gmm": _by_mixture, "minibatch": _by_minibatch}
)
"""Every method of finding groups by name."""


def method_named(name: str) -> Grouper:
    """Return a method of finding groups.

    Raises:
        ConfigError: there is no method of that name.
    """
    return named("threshold", METHODS, name)


def probability_incorrect(losses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return (D,) the probability that each demonstration is incorrect, for losses (D,).

    A mixture of two Gaussians of equal variance and a single Gaussian are fitted to sqrt(loss). The
    probability is that of the upper component, times the probability by BIC that there are two
    components. Like the losses it treats rare behaviour as incorrect; it is calibrated as far as
    the components are Gaussian.
    """
    from sklearn.mixture import GaussianMixture  # importing it takes a second

    roots = np.sort(np.sqrt(np.maximum(losses, 0)))[:, None]
    if np.ptp(roots) < NO_SPREAD:
        return np.zeros(len(losses))
    one, two = (
        GaussianMixture(
            count,
            covariance_type="tied",
            means_init=-_kmeans_means(-roots.ravel(), count),
            reg_covar=LEAST_ROOT_VARIANCE,
            random_state=0,
        ).fit(roots)
        for count in (1, 2)
    )
    upper = int(two.means_.argmax())
    shares = two.predict_proba(np.sqrt(np.maximum(losses, 0))[:, None])[:, upper]
    return np.asarray(shares * expit((one.bic(roots) - two.bic(roots)) / 2))


def _smallest_gap(weights: NDArray[np.float64], grouping: Grouping) -> float:
    means = [weights[grouping.groups == group].mean() for group in range(grouping.count)]
    return float(min(-np.diff(means), default=0.0))


def _silhouette(weights: NDArray[np.float64], grouping: Grouping) -> float:
    """Return the mean silhouette; one alone in its group counts 0, as in scikit-learn."""
    sizes = np.bincount(grouping.groups)
    sums = np.stack(
        [_distance_sums(weights, weights[grouping.groups == g]) for g in range(len(sizes))], axis=1
    )
    everyone, own = np.arange(len(weights)), grouping.groups
    inner = sums[everyone, own] / np.maximum(sizes[own] - 1, 1)
    means = sums / sizes
    means[everyone, own] = np.inf
    outer = means.min(axis=1)
    values = (outer - inner) / np.maximum(np.maximum(inner, outer), 1e-12)
    return float(np.where(sizes[own] == 1, 0.0, values).mean())


def _distance_sums(
    weights: NDArray[np.float64], members: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return (D,): sum of the distances of each weight to all members of a group (n,)."""
    members = np.sort(members)
    below = np.concatenate([[0.0], np.cumsum(members)])
    place = np.searchsorted(members, weights)
    left = weights * place - below[place]
    return np.asarray(left + below[-1] - below[place] - weights * (len(members) - place))
