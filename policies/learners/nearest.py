"""Behaviour cloning at the joint level by nearest neighbours: chunks of the nearest demonstration.

Visual imitation through nearest neighbours (Pari et al., "The Surprising Effectiveness of
Representation Learning for Visual Imitation", RSS 2022, section III-C) from the state, with chunks
of actions as in ACT (Zhao et al., RSS 2023). One neighbour is followed instead of a mean of
several: the mean of two good ways to reach for a cup may knock it over. Only the scale of the state
is fitted, so the policy can do only what a demonstration did from a similar state.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray

from policies.data.motions import MotionSamples, distinct_demos
from policies.data.weighting import weigh
from policies.learners.motion_policy import MotionPolicy
from policies.learners.store import DemonstrationStore, StoreShape
from teasim.common.errors import ConfigError

PROBED = 10
"""Least distance of the steps that are compared with the other demonstrations for the history
[control steps]."""
MOST_PROBES = 400
"""Most steps that are compared: each of them is compared with all steps there are."""


@dataclass(frozen=True)
class NearestConfig:
    """Settings of the nearest neighbour."""

    chunk: int = 8
    """H, control steps (0.1 s) that are executed before the next query."""
    seed: int = 0
    """Has no effect: nothing is drawn while learning."""

    def __post_init__(self) -> None:
        """Raise ConfigError for an empty chunk."""
        if self.chunk < 1:
            raise ConfigError(f"chunk is {self.chunk}; choose 1 or more.")


class Nearest:
    """Stores the demonstrations; `policy_` follows the nearest one."""

    policy_: MotionPolicy
    history_: tuple[float, ...]
    """Mean difference between a demonstration's targets and those of the nearest step of the
    others [rad; m for grippers]; 0 for a single demonstration."""

    def __init__(self, config: NearestConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or NearestConfig()

    def fit(self, samples: MotionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        samples, shares = weigh(samples, weights)
        demos = distinct_demos(samples, shares)
        low_dim = np.concatenate([demo.low_dim for demo in demos])
        targets = np.concatenate([demo.targets for demo in demos])
        stops = np.cumsum([len(demo.targets) for demo in demos])
        shape = StoreShape(
            len(low_dim), low_dim.shape[1], targets.shape[1], len(stops), self.config.chunk
        )
        store = DemonstrationStore(shape)
        store.keep(low_dim, targets, stops, np.array([demo.share for demo in demos]))
        self.policy_ = MotionPolicy(store, samples.spec, samples.action_names)
        self.history_ = (_difference(store),)
        return self


def _difference(store: DemonstrationStore) -> float:
    """Mean difference between targets and those of the nearest steps of other demonstrations."""
    edges, targets = store.edges, store.targets.numpy()
    apart = max(PROBED, len(targets) // MOST_PROBES)
    missed = []
    for demo, (start, stop) in enumerate(pairwise(edges)):
        for row in range(start, stop, apart):
            rows, costs = store.entries(store.low_dim[row].numpy())
            costs[demo] = np.inf
            if np.isfinite(costs).any():
                missed.append(float(np.abs(targets[row] - targets[rows[costs.argmin()]]).mean()))
    return float(np.mean(missed)) if missed else 0.0
