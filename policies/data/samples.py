"""What a learner is given, and how a policy is called."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

Observation = Mapping[str, Any]
"""One of `TeaMakingSubtasks-v0`: `pixels` ((H, W, 3) uint8 per camera) and `agent_pos` (J,), or
`agent_pos` and `environment_state` (E,)."""

STATE_KEYS = ("agent_pos", "environment_state")
"""Parts of the observation that are the state, in the order in which a policy sees them."""

RecurrentState = tuple[NDArray[np.floating[Any]], ...]
"""What a recurrent policy carries from one decision to the next."""


@dataclass(frozen=True)
class ObservationSpec:
    """What a policy sees; an environment must provide exactly this."""

    cameras: tuple[str, ...]
    """Cameras in the order of their features; empty: the policy sees the state alone."""
    height: int
    """Height of a frame [pixel]; 0 without cameras."""
    width: int
    """Width of a frame [pixel]; 0 without cameras."""
    state_names: tuple[str, ...] = ()
    """Names of the joint positions [rad; m for grippers]; empty: the policy sees frames alone."""
    environment_names: tuple[str, ...] = ()
    """Names of the environment state (poses [m], amounts [ml or g]); empty: it is not seen."""

    @property
    def low_dim(self) -> int:
        """S, how many numbers are seen besides the pictures."""
        return len(self.state_names) + len(self.environment_names)


@dataclass(frozen=True)
class DecisionSamples:
    """The decisions of a pool: the observation before each sub-task, and the sub-task chosen.

    There are n decisions, each in V views (the original frames, then altered copies) of K cameras.
    Those of one demonstration are in temporal order.
    """

    maps: NDArray[np.float16]
    """Feature maps of the frames.  # (n, V, K, C, h, w)"""
    low_dim: NDArray[np.float32]
    """Joint positions, then environment state; S = 0 if only frames are seen.  # (n, S)"""
    labels: NDArray[np.int64]
    """Chosen sub-task, an index into `action_names`.  # (n,)"""
    demos: NDArray[np.int64]
    """Position in the pool of the demonstration the decision comes from.  # (n,)"""
    spec: ObservationSpec
    """What is seen."""
    action_names: tuple[str, ...]
    """Sub-tasks a policy chooses from, in the order of the actions."""

    def __post_init__(self) -> None:
        """Check that the fields belong together and make the arrays read-only."""
        arrays = (self.maps, self.low_dim, self.labels, self.demos)
        if len({len(array) for array in arrays}) != 1:
            raise ValueError(f"fields differ in length: {[len(array) for array in arrays]}")
        if self.maps.ndim != 6 or self.maps.shape[2] != len(self.spec.cameras):
            raise ValueError(f"maps have shape {self.maps.shape}, not (n, V, K, C, h, w)")
        if self.low_dim.shape[1:] != (self.spec.low_dim,):
            raise ValueError(f"low_dim has shape {self.low_dim.shape}, not (n, S)")
        if len(self.labels) and not 0 <= self.labels.min() <= self.labels.max() < self.n_actions:
            raise ValueError(f"labels must lie in [0, {self.n_actions})")
        if not (np.isfinite(self.maps).all() and np.isfinite(self.low_dim).all()):
            raise ValueError("an input is not finite")
        for array in arrays:
            array.setflags(write=False)

    @property
    def n_actions(self) -> int:
        """Number of sub-tasks to choose from."""
        return len(self.action_names)

    def take(self, rows: NDArray[np.int64] | NDArray[np.bool_]) -> "DecisionSamples":
        """Return the decisions at `rows` (indices, repeats allowed, or a mask)."""
        return DecisionSamples(
            self.maps[rows],
            self.low_dim[rows],
            self.labels[rows],
            self.demos[rows],
            self.spec,
            self.action_names,
        )


def pictures(observation: Observation, cameras: tuple[str, ...]) -> dict[str, NDArray[np.uint8]]:
    """Return the frame or batch of frames of each of `cameras`.

    `pixels` is a picture for one camera, and a mapping of pictures for several. In observations
    for stable-baselines3 (sb3.py) the pictures of several cameras have separate keys.
    """
    if "pixels" not in observation:
        return {camera: np.asarray(observation[f"pixels_{camera}"]) for camera in cameras}
    pixels = observation["pixels"]
    if isinstance(pixels, Mapping):
        return {camera: np.asarray(pixels[camera]) for camera in cameras}
    return {cameras[0]: np.asarray(pixels)}


class Policy(Protocol):
    """A decision rule with the calling convention of stable-baselines3."""

    spec: ObservationSpec
    """What it sees."""
    action_names: tuple[str, ...]
    """Names of its actions."""

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

        `state` is None for a policy that is not recurrent; `episode_start` (n,) marks new episodes.
        """


class TrainedPolicy:
    """Common part of the learned policies; subclasses implement `predict`."""

    def __init__(self, network: Any, spec: ObservationSpec, action_names: tuple[str, ...]) -> None:
        """Hold a trained network; random numbers start at seed 0."""
        network.eval()
        self.network = network
        self.spec = spec
        self.action_names = action_names
        self.set_random_seed(0)

    def set_random_seed(self, seed: int) -> None:
        """Restart the random numbers of sampled decisions."""
        self._random = np.random.default_rng(seed)
