"""The control steps of a pool as the learners of joint targets draw them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from policies.data.motions import MotionDemo, MotionSamples, distinct_demos
from policies.data.weighting import weigh
from policies.learners.joints.steps.inputs import StateInputs
from policies.learners.joints.steps.involved import involved_bodies, relevance
from policies.learners.joints.steps.rests import restless
from policies.learners.joints.steps.switches import age_inputs, steps_since_change, switch_values

OF_HANDS = "_hand"
"""Part of the names of numbers of the environment that change when only the arms move."""


@dataclass(frozen=True)
class Rows:
    """The steps to learn from, one demonstration after the other, without rests."""

    given: NDArray[np.float32]
    """Inputs; those that fade after a change of a switch come last.  # (n, I)"""
    measured: NDArray[np.float32]
    """Measured positions that targets are relative to; 0 for switches.  # (n, J)"""
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
    relevant: NDArray[np.float32]
    """1 for each input that matters for a sub-task, else 0.  # (E, I)"""

    @property
    def switches(self) -> list[int]:
        """Places of the switches."""
        return list(self.values)

    @property
    def starts(self) -> NDArray[np.int64]:
        """First row of each demonstration, (D,)."""
        return np.append(0, self.stops[:-1])

    def last(self, rows: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the last row of the demonstration of each of `rows` (n,), (n,)."""
        return np.asarray(self.stops[np.searchsorted(self.stops, rows, side="right")] - 1)

    def planned(self, rows: NDArray[np.int64], chunk: int) -> NDArray[np.float32]:
        """Return the next `chunk` targets (n, K, J) from `rows`, relative to measured positions.

        After the last step of a demonstration its target is held. Switches are not relative.
        """
        ahead = np.minimum(rows[:, None] + np.arange(chunk), self.last(rows)[:, None])
        return np.asarray(self.targets[ahead] - self.measured[rows, None])


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
    inputs = StateInputs(names)
    given = np.concatenate([_given(demo, inputs, list(values), timed=timed) for demo in kept])
    involved = involved_bodies(kept, names, 1 + max(int(demo.subtasks.max()) for demo in kept))
    return Rows(
        given=given,
        measured=np.concatenate([_measured(demo, list(values)) for demo in kept]),
        targets=np.concatenate([demo.targets for demo in kept]),
        subtasks=np.concatenate([demo.subtasks for demo in kept]),
        stops=np.cumsum([len(demo.targets) for demo in kept]),
        shares=np.array([demo.share for demo in kept]),
        values=values,
        relevant=relevance(inputs.sources, involved, given.shape[1] - inputs.count),
    )


def _given(
    demo: MotionDemo, inputs: StateInputs, switches: list[int], *, timed: bool
) -> NDArray[np.float32]:
    seen = inputs(demo.low_dim)
    if not timed:
        return seen
    return np.hstack([seen, age_inputs(steps_since_change(demo.targets[:, switches]))])


def _measured(demo: MotionDemo, switches: list[int]) -> NDArray[np.float32]:
    measured = demo.low_dim[:, : demo.targets.shape[1]].copy()
    measured[:, switches] = 0
    return measured


def _without_rests(demo: MotionDemo, switches: list[int], world: Sequence[int]) -> MotionDemo:
    return demo.take(restless(demo.low_dim, demo.targets, switches, list(world)))
