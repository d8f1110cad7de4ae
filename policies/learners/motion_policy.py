"""A policy over joint targets that follows a stored demonstration, chunk by chunk.

Its recurrent state is the next step of the demonstration. At the start of an episode it chooses the
demonstration nearest to what it sees, or draws one with probabilities from distance and weight.
After every chunk it moves to the step of the demonstration that fits best, or changes to another
demonstration that is much nearer.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.special import softmax

from policies.data.motions import seen_numbers
from policies.data.samples import Observation, RecurrentState, TrainedPolicy
from policies.learners.store import DemonstrationStore


class JointPolicy(TrainedPolicy):
    """Common part of the policies that choose joint targets; subclasses implement `predict`."""

    draws = False
    """Whether sampled decisions differ from deterministic ones."""

    def predict(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], RecurrentState | None]:
        """Return joint targets [rad; m for grippers], (J,) for one observation, (n, J) for n.

        `state` is None at the start of an episode; `episode_start` (n,) marks new episodes.
        """
        raise NotImplementedError


class MotionPolicy(JointPolicy):
    """Chooses joint targets; called like `policies.data.samples.Policy`."""

    draws = True

    network: DemonstrationStore

    def predict(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float32], RecurrentState | None]:
        """Return joint targets [rad; m for grippers], (J,) for one observation, (n, J) for n.

        The recurrent state afterwards, (n, 2), is the next step and the number of steps left in the
        chunk.
        """
        seen = seen_numbers(observation, self.spec)
        single = seen.ndim == 1
        seen = np.atleast_2d(seen)
        fresh = np.ones(len(seen), dtype=np.bool_)
        if state is not None:
            fresh = np.zeros_like(fresh) if episode_start is None else np.asarray(episode_start)
        memory = np.zeros((len(seen), 2)) if state is None else np.array(state[0])
        rows = np.array(
            [
                self._row(numbers, bool(new), memory[n], deterministic)
                for n, (numbers, new) in enumerate(zip(seen, fresh, strict=True))
            ]
        )
        chunk = self.network.shape.chunk
        left = np.where(fresh | (memory[:, 1] < 1), chunk, memory[:, 1]) - 1
        stays = np.array([self.network.is_last(row) for row in rows])
        targets = self.network.targets.numpy()[rows]
        following = np.stack([np.where(stays, rows, rows + 1), left], axis=1).astype(np.float64)
        return (targets[0] if single else targets), (following,)

    def _row(
        self,
        seen: NDArray[np.float32],
        fresh: bool,
        memory: NDArray[np.float64],
        deterministic: bool,
    ) -> int:
        """Return the row of the stored step to execute now."""
        if fresh:
            rows, costs = self.network.entries(seen)
            demo = costs.argmin() if deterministic else self._draw(-costs)
            return int(rows[demo])
        planned = int(memory[0])
        return planned if memory[1] >= 1 else self.network.next_row(seen, planned)

    def _draw(self, log_odds: NDArray[np.float64]) -> int:
        edges = np.cumsum(softmax(log_odds))
        return int(np.searchsorted(edges, self._random.random() * edges[-1], side="right"))
