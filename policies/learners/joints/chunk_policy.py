"""A policy that joins the plans of successive control steps into joint targets.

Its recurrent state is the joined plan, when each switch changed last, and what the network
remembers. It draws nothing, so sampled decisions equal deterministic ones.
"""

from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray

from filtering.vision.determinism import one_thread
from policies.data.motions import seen_numbers
from policies.data.samples import Observation, ObservationSpec, RecurrentState
from policies.learners.joints.networks import PlanNetwork
from policies.learners.joints.steps.inputs import StateInputs
from policies.learners.joints.steps.switches import OLDEST, age_inputs
from policies.learners.motion_policy import JointPolicy


class ChunkPolicy(JointPolicy):
    """Chooses joint targets; called like `policies.data.samples.Policy`."""

    network: PlanNetwork

    def __init__(
        self, network: PlanNetwork, spec: ObservationSpec, action_names: tuple[str, ...]
    ) -> None:
        """Hold a trained network."""
        super().__init__(network, spec, action_names)
        self._inputs = StateInputs((*spec.state_names, *spec.environment_names))
        values = network.values.numpy()
        self._values = {
            place: row[np.isfinite(row)] for place, row in enumerate(values) if row[0] == row[0]
        }

    def predict(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,  # noqa: ARG002  (the protocol's)
    ) -> tuple[NDArray[np.float32], RecurrentState | None]:
        """Return joint targets [rad; m for grippers], (J,) for one observation, (n, J) for n.

        The recurrent state afterwards holds the plan (n, K, J) and its weight (n, K), the steps
        since the switches changed and their last targets (n, G), and the network's own.
        """
        seen = seen_numbers(observation, self.spec)
        rows = np.atleast_2d(seen)
        memory = self._fresh(len(rows)) if state is None else tuple(map(np.copy, state))
        if state is not None and episode_start is not None:
            for before, new in zip(memory, self._fresh(len(rows)), strict=True):
                before[np.asarray(episode_start)] = new[np.asarray(episode_start)]
        plan, mass, ages, last, *hidden = memory
        newest, hidden = self._plan(rows, ages, hidden)
        keep = self.network.ensemble * mass
        plan = (newest + keep[..., None] * plan) / (1 + keep)[..., None]
        targets = plan[:, 0].copy()
        commands = self._switch(plan[:, 0], targets)
        changed = (commands != last) & np.isfinite(last)
        ages = np.where(changed, 1.0, np.minimum(ages + 1, OLDEST))
        following = _ahead(plan), _ahead(1 + keep), ages, commands, *hidden
        return (targets[0] if seen.ndim == 1 else targets).astype(np.float32), following

    def _fresh(self, count: int) -> RecurrentState:
        """Return the recurrent state at the start of `count` episodes."""
        shape = self.network.shape
        switches = (count, len(self._values))
        return (
            np.zeros((count, shape.chunk, shape.actions)),
            np.zeros((count, shape.chunk)),
            np.full(switches, float(OLDEST)),
            np.full(switches, np.nan),
            *(np.zeros((count, size), np.float32) for size in self.network.memory),
        )

    def _plan(
        self,
        seen: NDArray[np.float32],
        ages: NDArray[np.floating],
        hidden: Sequence[NDArray[np.floating]],
    ) -> tuple[NDArray[np.floating], list[NDArray[np.floating]]]:
        """Return the newest plan (n, K, J) of absolute targets, and what the network remembers."""
        inputs = self._inputs(seen)
        if self.network.shape.inputs > inputs.shape[1]:
            inputs = np.hstack([inputs, age_inputs(ages)])
        before = tuple(torch.from_numpy(part) for part in hidden)
        with one_thread(), torch.inference_mode():
            _, planned, after = self.network.plan(torch.from_numpy(inputs), None, before)
        measured = seen[:, : self.network.shape.actions].astype(np.float64)
        measured[:, list(self._values)] = 0
        return planned.numpy() + measured[:, None], [part.numpy() for part in after]

    def _switch(
        self, newest: NDArray[np.floating], targets: NDArray[np.floating]
    ) -> NDArray[np.floating]:
        """Set each switch in `targets` (n, J) to its value nearest to the plan; return them."""
        for place, values in self._values.items():
            nearest = np.abs(newest[:, place, None] - values).argmin(axis=1)
            targets[:, place] = values[nearest]
        return targets[:, list(self._values)]


def _ahead(plan: NDArray[np.floating]) -> NDArray[np.floating]:
    """Return a plan (n, K, ...) one step later; nothing is known of its last step."""
    return np.concatenate([plan[:, 1:], np.zeros_like(plan[:, :1])], axis=1)
