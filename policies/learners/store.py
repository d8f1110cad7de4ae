"""Demonstrations stored as they are: what was seen at every control step, and the joint targets.

A query finds the nearest stored step. Each number of the state is compared in units of its spread
over the demonstrations. The spread has a least value: otherwise a number that hardly varies in them
would dominate the distance after a small displacement.
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
"""Difference in every number of the state that costs half a nat [scales]."""
SWITCH = 5.0
"""Cost of changing to another demonstration [nat]."""
OUT_OF_STEP = 0.05
"""Cost of each step that is skipped or repeated [nat]; it keeps time while nothing moves."""
EARLIER, LATER = 4, 8
"""Window around the planned step of the followed demonstration that is searched [control steps]."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StoreShape:
    """Sizes of a store of demonstrations."""

    steps: int
    """n, control steps in all."""
    low_dim: int
    """S, numbers of the state."""
    actions: int
    """J, joint targets."""
    demos: int
    """D, different demonstrations."""
    chunk: int
    """H, control steps that are executed before the next query."""


class DemonstrationStore(nn.Module):
    """The demonstrations one after the other, and queries for the nearest step."""

    kind: ClassVar[str] = "memory"
    """Name under which it is saved."""
    low_dim: Tensor
    """State at every step.  # (n, S)"""
    targets: Tensor
    """Joint targets [rad; m for grippers].  # (n, J)"""
    stops: Tensor
    """Row after the last one of each demonstration.  # (D,)"""
    chances: Tensor
    """Share of the weight that each demonstration has.  # (D,)"""
    scale: Tensor
    """Spread of every number of the state.  # (S,)"""

    def __init__(self, shape: StoreShape, seed: int = 0) -> None:  # noqa: ARG002
        """Allocate the buffers; nothing is drawn from `seed`."""
        super().__init__()
        self.shape = shape
        self.register_buffer("low_dim", torch.zeros(shape.steps, shape.low_dim))
        self.register_buffer("targets", torch.zeros(shape.steps, shape.actions))
        self.register_buffer("stops", torch.full((shape.demos,), shape.steps))
        self.register_buffer("chances", torch.full((shape.demos,), 1 / shape.demos))
        self.register_buffer("scale", torch.ones(shape.low_dim))

    @property
    def settings(self) -> Mapping[str, int]:
        """Nothing is needed besides the shape."""
        return {}

    @property
    def edges(self) -> NDArray[np.int64]:
        """First row of each demonstration, and the row after the last one, (D + 1,)."""
        return np.append(0, self.stops.numpy())

    def keep(self, low_dim: Array, targets: Array, stops: NDArray[np.int64], shares: Array) -> None:
        """Store demonstrations: (n, S), (n, J), (D,) and their shares (D,), which sum to 1."""
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
        """Return the distance of the state `seen` (S,) to each of the steps `rows`, (m,) [nat]."""
        away = (self.low_dim[rows].numpy() - seen) / (BANDWIDTH * self.scale.numpy())
        return np.asarray((away.astype(np.float64) ** 2).mean(axis=1) / 2)

    def entries(self, seen: NDArray[np.float32]) -> tuple[NDArray[np.int64], Array]:
        """Return the nearest step of each demonstration, (D,), and the cost to follow it, (D,)."""
        costs, edges = self.costs(seen), self.edges
        rows = np.array([start + costs[start:stop].argmin() for start, stop in pairwise(edges)])
        return rows, costs[rows] - np.log(self.chances.double().numpy())

    def next_row(self, seen: NDArray[np.float32], row: int) -> int:
        """Return the step to execute next, given that step `row` was planned.

        It is the cheapest step near `row` in the same demonstration, or the nearest step of another
        demonstration if that costs less by `SWITCH`.
        """
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
        """Whether step `row` is the last of its demonstration."""
        return bool((self.stops == row + 1).any())
