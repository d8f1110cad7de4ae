"""What a learner is given, and how a policy is asked for a decision."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Observation = Mapping[str, Any]
"""One of `TeaMakingSubtasks-v0`: `pixels` (camera -> (H, W, 3) uint8) and `agent_pos` (J,)."""

RecurrentState = tuple[NDArray[np.float32], ...]
"""What a policy with a memory carries from one decision to the next."""


@dataclass(frozen=True)
class ObservationSpec:
    """What a policy looks at; an environment must offer exactly this."""

    cameras: tuple[str, ...]
    """Cameras in the order of their features."""
    height: int
    """Height of a frame [pixel]."""
    width: int
    """Width of a frame [pixel]."""
    state_names: tuple[str, ...] = ()
    """Names of the joint positions [rad; m for grippers]; empty: the policy sees frames alone."""


@dataclass(frozen=True)
class DecisionSamples:
    """The decisions of a pool: what was seen before each sub-task, and which one was chosen.

    A decision that was seen in k frames is k samples of share 1/k, so every decision counts once.
    """

    inputs: NDArray[np.float32]
    """Features of what was seen.  # (n, F)"""
    labels: NDArray[np.int64]
    """Chosen sub-task, an index into `action_names`.  # (n,)"""
    demos: NDArray[np.int64]
    """Position in the pool of the demonstration the sample comes from.  # (n,)"""
    shares: NDArray[np.float64]
    """Share of its decision that the sample stands for, in (0, 1].  # (n,)"""
    spec: ObservationSpec
    """What the inputs were made of."""
    action_names: tuple[str, ...]
    """Sub-tasks a policy chooses from, in the order of the actions."""

    def __post_init__(self) -> None:
        """Check that the fields belong together and make the arrays read-only."""
        rows = {len(self.inputs), len(self.labels), len(self.demos), len(self.shares)}
        if len(rows) != 1 or self.inputs.ndim != 2:
            raise ValueError(f"inputs {self.inputs.shape} and the other fields differ in length")
        if len(self.labels) and not 0 <= self.labels.min() <= self.labels.max() < self.n_actions:
            raise ValueError(f"labels must lie in [0, {self.n_actions})")
        if not np.isfinite(self.inputs).all():
            raise ValueError("inputs hold a value that is not finite")
        for array in (self.inputs, self.labels, self.demos, self.shares):
            array.setflags(write=False)

    @property
    def n_actions(self) -> int:
        """Number of sub-tasks to choose from."""
        return len(self.action_names)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> "DecisionSamples":
        """Return the samples at `rows` (indices, repeats allowed, or a mask)."""
        return DecisionSamples(
            self.inputs[rows],
            self.labels[rows],
            self.demos[rows],
            self.shares[rows],
            self.spec,
            self.action_names,
        )


class Policy(Protocol):
    """A decision rule with the calling convention of stable-baselines3."""

    spec: ObservationSpec
    action_names: tuple[str, ...]

    def set_random_seed(self, seed: int) -> None:
        """Restart the random numbers of sampled decisions."""

    def predict(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.int64], RecurrentState | None]:
        """Choose an action, () int64 for one observation and (n,) for a batch of n.

        `state` is None for a policy without memory; `episode_start` (n,) tells where it restarts.
        """
