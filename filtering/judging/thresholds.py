"""From weights to groups: clusters and the mid-points between them (paper section 3.3).

k-means is exact, because it is one-dimensional; a Gaussian mixture and mini-batch k-means are there
as the paper has them.

The paper is told the number of groups. Here it can also be chosen from the data, one group
included: in a clean pool nothing is flagged.
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
"""What may be asked for."""
MIN_GAP = 0.5
"""Least distance between the mean weights of two groups for them to be two [weight]."""
MIN_GAP_OF_THREE = 0.25
"""Least distance between neighbouring means of three groups [weight]."""

DIGITS = 9
"""Weights and losses that agree to so many decimal places are equal."""
LEAST_VARIANCE = 1e-4
"""Least variance of a group of weights."""
LEAST_ROOT_VARIANCE = 0.05
"""Least variance of a group of sqrt(l) [nats]: a twentieth of a nat is no difference."""
NO_SPREAD = 1e-6
"""Values of sqrt(l) that differ by less are equal."""


@dataclass(frozen=True)
class Grouping:
    """The groups of a pool's demonstrations."""

    groups: NDArray[np.int64]
    """(D,) group of each demonstration; 0 has the highest weights and is kept."""
    threshold: float
    """Weight below which a demonstration is flagged; 0 when there is one group."""
    names: tuple[str, ...] = ()
    """What the groups have in common, in words; empty where only the weights tell."""

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """(D,) True for every demonstration outside group 0."""
        return self.groups > 0

    @property
    def count(self) -> int:
        """Number of groups."""
        return int(self.groups.max()) + 1


def group_weights(
    weights: NDArray[np.float64], groups: str = "auto", method: str = "kmeans"
) -> Grouping:
    """Split weights (D,) into groups and put the threshold between group 0 and group 1.

    Asked-for groups are fewer when there are fewer different weights than groups.

    Args:
        weights: in [0, 1].
        groups: one of GROUPS.
        method: one of METHODS.

    Raises:
        ConfigError: `groups` or `method` is unknown, or there are fewer demonstrations than groups.
    """
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


Grouper = Callable[[NDArray[np.float64], int], Grouping]
"""Splits weights (D,) into so many groups, fewer where a group would be empty."""


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
    # A third group may refine what is flagged, but must not take demonstrations from the kept ones.
    same_kept = np.array_equal(two.flagged, three.flagged)
    return three if clear and better and same_kept else two


def _by_kmeans(weights: NDArray[np.float64], count: int) -> Grouping:
    """Return the exact k-means solution; equal weights always share a group."""
    groups = kmeans(-weights, count)
    if count == 1:
        return Grouping(groups, 0.0)
    middle = (weights[groups == 0].mean() + weights[groups == 1].mean()) / 2
    # The mid-point of the means may fall inside a wide group; the groups decide: keep it between.
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
    """Cut at the mid-points of the means; a group that nobody is in is none."""
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
"""Every way of finding groups by name."""


def method_named(name: str) -> Grouper:
    """Return a way of finding groups.

    Raises:
        ConfigError: there is none of that name.
    """
    return named("threshold", METHODS, name)


def probability_incorrect(losses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return for losses (D,) how probable it is that each demonstration is incorrect.

    Two Gaussians of one variance are fitted to sqrt(l), beside a single one. The probability is
    that of the upper one given l, times that of there being two at all, by their BIC. Like the
    losses it takes what few do for incorrect; it is calibrated as far as both are Gaussian.
    """
    from sklearn.mixture import GaussianMixture  # only here: importing it takes a second

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
    """Return the mean silhouette; a demonstration alone in its group counts 0, as is the custom."""
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
    """Return (D,): sum of the distances of each weight to all members of a group."""
    members = np.sort(members)
    below = np.concatenate([[0.0], np.cumsum(members)])
    place = np.searchsorted(members, weights)
    left = weights * place - below[place]
    return np.asarray(left + below[-1] - below[place] - weights * (len(members) - place))
