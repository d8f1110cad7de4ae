"""The control steps of a pool as the learners of joint targets draw them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from policies.data.motions import MotionDemo, MotionSamples, distinct_demos
from policies.data.weighting import weigh
from policies.learners.joints.inputs import StateInputs
from policies.learners.joints.rests import restless
from policies.learners.joints.switches import age_inputs, steps_since_change, switch_values

OF_HANDS = "_hand"
"""Part of the names of numbers of the environment that change when only the arms move."""


@dataclass(frozen=True)
class Rows:
    """The steps to learn from, one demonstration after the other, without rests."""

    low_dim: NDArray[np.float32]
    """What was seen.  # (n, S)"""
    ages: NDArray[np.float32]
    """Control steps since each switch changed.  # (n, G)"""
    targets: NDArray[np.float32]
    """Joint targets [rad; m for grippers].  # (n, J)"""
    subtasks: NDArray[np.int64]
    """The sub-task each step belongs to.  # (n,)"""
    stops: NDArray[np.int64]
    """Row after the last one of each demonstration.  # (D,)"""
    shares: NDArray[np.float64]
    """Share of the total weight of each demonstration.  # (D,)"""
    values: dict[int, NDArray[np.float32]]
    """Values of each switch by its place among the targets."""
    inputs: StateInputs
    """Turns what was seen into inputs."""
    timed: bool
    """Whether inputs tell how long ago the switches changed."""

    @property
    def switches(self) -> list[int]:
        """Places of the switches."""
        return list(self.values)

    @property
    def starts(self) -> NDArray[np.int64]:
        """First row of each demonstration, (D,)."""
        return np.append(0, self.stops[:-1])

    def given(self, rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return the inputs (n, I) at `rows`; those that fade after a change come last."""
        seen = self.inputs(self.low_dim[rows])
        return np.hstack([seen, age_inputs(self.ages[rows])]) if self.timed else seen

    def planned(self, rows: NDArray[np.int64], chunk: int) -> NDArray[np.float32]:
        """Return the next `chunk` targets (n, K, J) from `rows`, relative to measured positions.

        After the last step of a demonstration its target is held. Switches are not relative.
        """
        last = self.stops[np.searchsorted(self.stops, rows, side="right")] - 1
        ahead = np.minimum(rows[:, None] + np.arange(chunk), last[:, None])
        targets = self.targets[ahead]
        measured = self.low_dim[rows, None, : targets.shape[2]].copy()
        measured[..., self.switches] = 0
        return np.asarray(targets - measured)


def prepare(samples: MotionSamples, weights: NDArray[np.float64], *, timed: bool) -> Rows:
    """Return the rows of `samples` with one weight per demonstration, (D,).

    With `timed`, inputs tell how long ago the switches changed.

    Equal demonstrations are merged and all are sorted by a hash of their content, so neither their
    order nor how a weight is split over copies changes what is drawn.

    Raises:
        ConfigError: the weights do not fit the samples, or all are 0.
    """
    samples, shares = weigh(samples, weights)
    demos = distinct_demos(samples, shares)
    values = switch_values(np.concatenate([demo.targets for demo in demos]))
    spec = samples.spec
    names = (*spec.state_names, *spec.environment_names)
    joints = len(spec.state_names)
    world = [k for k, name in enumerate(names) if k >= joints and OF_HANDS not in name]
    kept = [_without_rests(demo, list(values), world) for demo in demos]
    ages = [steps_since_change(demo.targets[:, list(values)]) for demo in kept]
    return Rows(
        low_dim=np.concatenate([demo.low_dim for demo in kept]),
        ages=np.concatenate(ages),
        targets=np.concatenate([demo.targets for demo in kept]),
        subtasks=np.concatenate([demo.subtasks for demo in kept]),
        stops=np.cumsum([len(demo.targets) for demo in kept]),
        shares=np.array([demo.share for demo in kept]),
        values=values,
        inputs=StateInputs(names),
        timed=timed,
    )


def _without_rests(demo: MotionDemo, switches: list[int], world: Sequence[int]) -> MotionDemo:
    return demo.take(restless(demo.low_dim, demo.targets, switches, list(world)))
