"""A memoryless policy over sub-tasks: features of what is seen -> softmax -> a choice."""

import numpy as np
import torch
from numpy.typing import NDArray

from policies.base import Observation, ObservationSpec, RecurrentState, pictures
from policies.features import Maps, camera_maps
from policies.networks import DecisionNetwork, one_thread


class SubtaskPolicy:
    """Chooses the next sub-task from one observation (the paper, section 4.3)."""

    def __init__(
        self, network: DecisionNetwork, spec: ObservationSpec, action_names: tuple[str, ...]
    ) -> None:
        """Take over a trained network; random numbers start at seed 0."""
        self.network = network.eval()
        self.spec = spec
        self.action_names = action_names
        self.set_random_seed(0)

    def set_random_seed(self, seed: int) -> None:
        """Restart the random numbers of sampled decisions."""
        self._random = np.random.default_rng(seed)

    def probabilities(self, observation: Observation) -> NDArray[np.float64]:
        """Probability of every sub-task, (A,) for one observation and (n, A) for a batch."""
        pixels = pictures(observation, self.spec.cameras)
        single = next(iter(pixels.values())).ndim == 3
        if single:
            pixels = {camera: frames[None] for camera, frames in pixels.items()}
        maps = camera_maps(pixels, self.spec.cameras)
        joints = np.empty((len(maps), 0), dtype=np.float32)
        if self.spec.state_names:
            joints = np.asarray(observation["agent_pos"]).reshape(len(maps), -1)
        chances = self.action_probabilities(maps, joints)
        return chances[0] if single else chances

    def action_probabilities(self, maps: Maps, joints: NDArray[np.float32]) -> NDArray[np.float64]:
        """Probability of every sub-task (n, A) given maps (n, K, C, h, w) and joints (n, J)."""
        with torch.inference_mode(), one_thread():
            logits = self.network(torch.from_numpy(maps.copy()), torch.from_numpy(joints.copy()))
            chances: NDArray[np.float64] = torch.softmax(logits, dim=1).numpy()
        return chances

    def predict(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,  # noqa: ARG002  (the protocol's)
        deterministic: bool = False,
    ) -> tuple[NDArray[np.int64], RecurrentState | None]:
        """Choose the likeliest sub-task, or draw one; see `base.Policy.predict`."""
        chances = self.probabilities(observation)
        if deterministic:
            return chances.argmax(axis=-1), state
        # Inverse transform: one uniform number per observation, so a batch equals a loop.
        edges = np.cumsum(chances, axis=-1)
        draws = self._random.random(chances.shape[:-1])[..., None] * edges[..., -1:]
        return (edges > draws).argmax(axis=-1), state
