"""A policy over sub-tasks: observation -> features -> network -> softmax -> sub-task."""

import numpy as np
import torch
from numpy.typing import NDArray

from filtering.vision.determinism import one_thread
from policies.data.features import NO_MAPS, Maps, camera_maps, picture_maps
from policies.data.samples import (
    STATE_KEYS,
    Observation,
    ObservationSpec,
    RecurrentState,
    TrainedPolicy,
    pictures,
)
from policies.learners.networks import SubtaskNetwork


class SubtaskPolicy(TrainedPolicy):
    """Chooses the next sub-task from an observation (the paper, section 4.3)."""

    network: SubtaskNetwork

    def predict(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.int64], RecurrentState | None]:
        """Choose the most probable sub-task, or sample one; see `policies.data.samples.Policy`."""
        chances, memory = self.probabilities(observation, state, episode_start)
        if deterministic:
            return chances.argmax(axis=-1), memory
        # Inverse transform sampling with one uniform number per observation: a batch equals a loop.
        edges = np.cumsum(chances, axis=-1)
        draws = self._random.random(chances.shape[:-1])[..., None] * edges[..., -1:]
        return (edges > draws).argmax(axis=-1), memory

    def probabilities(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
    ) -> tuple[NDArray[np.float64], RecurrentState | None]:
        """Probability of every sub-task, (A,) for one observation and (n, A) for a batch.

        The second value is the recurrent state after the decision, None for a policy without one.
        """
        maps, low_dim, single = _look(observation, self.spec)
        if state is not None and episode_start is not None:
            goes_on = ~np.asarray(episode_start, dtype=np.bool_)[:, None]
            state = tuple(part * goes_on for part in state)
        chances, memory = self.decide(maps, low_dim, state)
        return (chances[0] if single else chances), memory

    def decide(
        self, maps: Maps, low_dim: NDArray[np.float32], state: RecurrentState | None = None
    ) -> tuple[NDArray[np.float64], RecurrentState | None]:
        """Probability of every sub-task (n, A) given maps (n, K, C, h, w) and state (n, S)."""
        memory = None if state is None else tuple(torch.from_numpy(part.copy()) for part in state)
        with torch.inference_mode(), one_thread():
            logits, after = self.network.step(
                torch.from_numpy(maps.copy()), torch.from_numpy(low_dim.copy()), memory
            )
            chances: NDArray[np.float64] = torch.softmax(logits, dim=1).numpy()
        return chances, tuple(part.numpy() for part in after) or None


def _look(
    observation: Observation, spec: ObservationSpec
) -> tuple[Maps, NDArray[np.float32], bool]:
    """Return maps (n, K, C, h, w), state (n, S), and whether it is a single observation."""
    if not spec.cameras:
        parts = [np.asarray(observation[key]) for key in STATE_KEYS]
        numbers = np.concatenate(parts, axis=-1)
        low_dim = np.atleast_2d(numbers)
        return np.empty((len(low_dim), *NO_MAPS), np.float16), low_dim, numbers.ndim == 1
    pixels = pictures(observation, spec.cameras)
    single = next(iter(pixels.values())).ndim == 3
    maps = (picture_maps if single else camera_maps)(pixels, spec.cameras)
    low_dim = np.empty((len(maps), 0), dtype=np.float32)
    if spec.state_names:
        low_dim = np.asarray(observation["agent_pos"]).reshape(len(maps), -1)
    return maps, low_dim, single
