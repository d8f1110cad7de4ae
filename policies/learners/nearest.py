"""Behaviour cloning at the joint level by looking up: chunks of the nearest demonstration.

Visual imitation through nearest neighbours (Pari et al., "The Surprising Effectiveness of
Representation Learning for Visual Imitation", RSS 2022, section III-C) from the state, with chunks
of actions as in ACT (Zhao et al., RSS 2023). One neighbour instead of a mean of several: the mean
of two good ways to reach for a cup can be one that knocks it over. Nothing is fitted but the scale
of what is seen, so it cannot do what no demonstration did from a state like the present one.
"""

import hashlib
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
from numpy.typing import NDArray

from policies.data.motions import MotionSamples
from policies.data.weighting import weigh
from policies.learners.chunks import Memory, MemoryShape
from policies.learners.motion_policy import MotionPolicy
from teasim.common.errors import ConfigError

PROBED = 10
"""Every so many control steps are looked up in the other demonstrations for the history."""


@dataclass(frozen=True)
class NearestConfig:
    """Settings of the nearest neighbour."""

    chunk: int = 8
    """H, control steps (0.1 s) that are carried out before the next look."""
    seed: int = 0
    """Nothing is drawn while learning; every learner has one."""

    def __post_init__(self) -> None:
        """Raise ConfigError for a chunk of nothing."""
        if self.chunk < 1:
            raise ConfigError(f"chunk is {self.chunk}; choose 1 or more.")


class Nearest:
    """Remember the demonstrations; `policy_` follows the nearest one."""

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
        demos = _different(samples, shares)
        low_dim, targets = (np.concatenate([demo[n] for demo in demos]) for n in (0, 1))
        stops = np.cumsum([len(demo[0]) for demo in demos])
        shape = MemoryShape(
            len(low_dim), low_dim.shape[1], targets.shape[1], len(stops), self.config.chunk
        )
        memory = Memory(shape)
        memory.keep(low_dim, targets, stops, np.array([demo[2] for demo in demos]))
        self.policy_ = MotionPolicy(memory, samples.spec, samples.action_names)
        self.history_ = (_difference(memory),)
        return self


Demo = tuple[NDArray[np.float32], NDArray[np.float32], float]


def _different(samples: MotionSamples, shares: NDArray[np.float64]) -> list[Demo]:
    """Return what was seen, the targets and the share of every different demonstration.

    Their order is that of their content, so that nothing depends on the order in the pool, and one
    that is there twice is the same as one of twice the weight.
    """
    found: dict[bytes, Demo] = {}
    for demo in np.unique(samples.demos):
        rows = samples.demos == demo
        seen, targets = samples.low_dim[rows], samples.targets[rows]
        key = hashlib.sha256(seen.tobytes() + targets.tobytes()).digest()
        before = found[key][2] if key in found else 0.0
        # A demonstration counts by its weight, not by its length.
        found[key] = (seen, targets, before + float(shares[rows].mean()))
    total = sum(share for _, _, share in found.values())
    return [(seen, targets, share / total) for _, (seen, targets, share) in sorted(found.items())]


def _difference(memory: Memory) -> float:
    """Return how far the nearest steps of other demonstrations are from what was done."""
    edges, targets = memory.edges, memory.targets.numpy()
    missed = []
    for demo, (start, stop) in enumerate(pairwise(edges)):
        for row in range(start, stop, PROBED):
            rows, costs = memory.entries(memory.low_dim[row].numpy())
            costs[demo] = np.inf
            if np.isfinite(costs).any():
                missed.append(float(np.abs(targets[row] - targets[rows[costs.argmin()]]).mean()))
    return float(np.mean(missed)) if missed else 0.0
