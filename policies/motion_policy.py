"""A policy over joint targets: state, style and time -> overlapping chunks -> one target a step.

At every control step the network says where the joints go during the next H; what is done is the
mean of all that was said about this step (temporal ensembling of Zhao et al., RSS 2023, section
IV-B). Each episode keeps to the style of one demonstration: the mean of two good ways to reach for
a cup can be one that knocks it over.
"""

import numpy as np
import torch
from numpy.typing import NDArray

from policies.base import Observation, ObservationSpec, RecurrentState
from policies.chunk_network import ChunkNetwork
from policies.motions import seen_numbers
from policies.networks import one_thread

ONE_STEP = np.array([0.0, 1.0])
"""How style and time change from one control step to the next."""


class MotionPolicy:
    """Says where the joints go next; see `base.Policy`, with targets in the place of a choice."""

    def __init__(
        self, network: ChunkNetwork, spec: ObservationSpec, action_names: tuple[str, ...]
    ) -> None:
        """Take over a trained network; random numbers start at seed 0."""
        network.eval()
        self.network = network
        self.spec = spec
        self.action_names = action_names
        self.set_random_seed(0)

    @property
    def typical(self) -> int:
        """Style of deterministic decisions: of those with the largest weight the best learned."""
        chances, errors = self.network.chances.numpy(), self.network.errors.numpy()
        return int(np.lexsort((errors, -chances.round(6)))[0])

    def set_random_seed(self, seed: int) -> None:
        """Restart the random numbers of sampled decisions."""
        self._random = np.random.default_rng(seed)

    def predict(
        self,
        observation: Observation,
        state: RecurrentState | None = None,
        episode_start: NDArray[np.bool_] | None = None,
        deterministic: bool = False,
    ) -> tuple[NDArray[np.float64], RecurrentState | None]:
        """Return joint targets [rad; m for grippers], (J,) for one observation, (n, J) for n.

        The memory after it has style and time (n, 2), and what was said of the next steps: sums of
        targets (n, H, J) and how many were summed (n, H, 1). A style is chosen where an episode
        starts: the typical one, or one drawn by the weights of the demonstrations.
        """
        seen = seen_numbers(observation, self.spec)
        single = seen.ndim == 1
        seen = np.atleast_2d(seen)
        course, sums, counts = self._remembered(len(seen), state, episode_start, deterministic)
        with torch.inference_mode(), one_thread():
            style, time = torch.from_numpy(course.astype(np.int64)).T
            chunks = self.network(torch.from_numpy(seen), style, time)
        sums, counts = sums + chunks.numpy(), counts + 1
        targets = sums[:, 0] / counts[:, 0]
        return (targets[0] if single else targets), (course + ONE_STEP, _next(sums), _next(counts))

    def _remembered(
        self,
        count: int,
        state: RecurrentState | None,
        episode_start: NDArray[np.bool_] | None,
        deterministic: bool,
    ) -> tuple[NDArray[np.float64], ...]:
        """Return the memory of `count` episodes, new and with a style where one starts."""
        shape = self.network.shape
        sizes = ((2,), (shape.chunk, shape.actions), (shape.chunk, 1))
        fresh = np.ones(count, dtype=np.bool_)
        memory = tuple(np.zeros((count, *size)) for size in sizes)
        if state is not None:
            fresh = np.zeros_like(fresh) if episode_start is None else np.asarray(episode_start)
            kept = zip(state, memory, strict=True)
            memory = tuple(np.where(_wide(fresh, old), new, old) for old, new in kept)
        memory[0][fresh, 0] = self.typical if deterministic else self._drawn(int(fresh.sum()))
        return memory

    def _drawn(self, count: int) -> NDArray[np.int64]:
        """Draw `count` styles by the weights of the demonstrations."""
        edges = np.cumsum(self.network.chances.double().numpy())
        places = np.searchsorted(edges, self._random.random(count) * edges[-1], side="right")
        return np.asarray(places, dtype=np.int64)


def _next(said: NDArray[np.float64]) -> NDArray[np.float64]:
    """What was said (n, H, ...) as the next step sees it: the first is done, nothing comes last."""
    return np.concatenate([said[:, 1:], np.zeros_like(said[:, :1])], axis=1)


def _wide(mask: NDArray[np.bool_], like: NDArray[np.floating]) -> NDArray[np.bool_]:
    return mask.reshape(-1, *[1] * (like.ndim - 1))
