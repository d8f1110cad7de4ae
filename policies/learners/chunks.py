"""Demonstrations that are looked up: what was seen at every control step, and what was done then.

The nearest step is found by what the numbers of the state differ, each in its own spread over the
demonstrations. What hardly moves in them must not decide alone when it is displaced by a little.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

SCALE_FLOOR = 0.05
"""Least scale of a number of the state [its unit]."""
BANDWIDTH = 0.1
"""Difference of all numbers that is half a nat less likely [scales]."""
SWITCH = 5.0
"""Nats that speak against leaving the demonstration that is followed."""
OUT_OF_STEP = 0.05
"""Nats against every step that is skipped or repeated: while nothing moves, time goes on."""
EARLIER, LATER = 4, 8
"""How far back and ahead the demonstration that is followed is looked at [control steps]."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class MemoryShape:
    """Sizes of the demonstrations that are remembered."""

    steps: int
    """n, control steps in all."""
    low_dim: int
    """S, numbers that are seen."""
    actions: int
    """J, joint targets."""
    demos: int
    """D, different demonstrations."""
    chunk: int
    """H, control steps that are carried out before the next look."""


class Memory(nn.Module):
    """The demonstrations one after the other, and how to find a step in them."""

    kind: ClassVar[str] = "memory"
    low_dim: Tensor
    """What was seen.  # (n, S)"""
    targets: Tensor
    """Where the joints were sent [rad; m for grippers].  # (n, J)"""
    stops: Tensor
    """Where each demonstration ends.  # (D,)"""
    chances: Tensor
    """Share of the weight that each demonstration has.  # (D,)"""
    scale: Tensor
    """Spread of every number that is seen.  # (S,)"""

    def __init__(self, shape: MemoryShape, seed: int = 0) -> None:  # noqa: ARG002
        """Make room for demonstrations; nothing is drawn from `seed`."""
        super().__init__()
        self.shape = shape
        self.register_buffer("low_dim", torch.zeros(shape.steps, shape.low_dim))
        self.register_buffer("targets", torch.zeros(shape.steps, shape.actions))
        self.register_buffer("stops", torch.full((shape.demos,), shape.steps))
        self.register_buffer("chances", torch.full((shape.demos,), 1 / shape.demos))
        self.register_buffer("scale", torch.ones(shape.low_dim))

    @property
    def settings(self) -> Mapping[str, int]:
        """Nothing beside the shape."""
        return {}

    @property
    def edges(self) -> NDArray[np.int64]:
        """Where each demonstration begins, and where the last one ends, (D + 1,)."""
        return np.append(0, self.stops.numpy())

    def keep(self, low_dim: Array, targets: Array, stops: NDArray[np.int64], shares: Array) -> None:
        """Take over demonstrations: (n, S), (n, J), (D,) and their shares (D,), which sum to 1."""
        lengths = np.diff(stops, prepend=0)
        weights = np.repeat(shares / lengths, lengths)
        spread = np.sqrt(weights @ (low_dim - weights @ low_dim) ** 2)
        kept = (
            (self.low_dim, low_dim),
            (self.targets, targets),
            (self.stops, stops),
            (self.chances, shares),
            (self.scale, np.hypot(spread, SCALE_FLOOR)),
        )
        for buffer, values in kept:
            buffer.copy_(torch.from_numpy(np.asarray(values)))

    def costs(self, seen: NDArray[np.float32], rows: slice = slice(None)) -> Array:
        """Return how unlikely what is seen (S,) is at each of the steps `rows`, (m,) [nats]."""
        away = (self.low_dim[rows].numpy() - seen) / (BANDWIDTH * self.scale.numpy())
        return np.asarray((away.astype(np.float64) ** 2).mean(axis=1) / 2)

    def entries(self, seen: NDArray[np.float32]) -> tuple[NDArray[np.int64], Array]:
        """Return the nearest step of each demonstration (D,) and the cost to follow it (D,)."""
        costs, edges = self.costs(seen), self.edges
        rows = np.array([start + costs[start:stop].argmin() for start, stop in pairwise(edges)])
        return rows, costs[rows] - np.log(self.chances.double().numpy())

    def next_row(self, seen: NDArray[np.float32], row: int) -> int:
        """Return the step to go on with for who was to come to step `row`."""
        edges = self.edges
        demo = int(np.searchsorted(edges, row, side="right")) - 1
        window = slice(max(row - EARLIER, edges[demo]), min(row + LATER + 1, edges[demo + 1]))
        near = self.costs(seen, window)
        near += OUT_OF_STEP * np.abs(np.arange(window.start, window.stop) - row)
        near -= math.log(float(self.chances[demo]))
        rows, others = self.entries(seen)
        if others.min() + SWITCH < near.min():
            return int(rows[others.argmin()])
        return window.start + int(near.argmin())

    def is_last(self, row: int) -> bool:
        """Whether a demonstration ends with step `row`."""
        return bool((self.stops == row + 1).any())
