"""The network that scores sub-tasks: standardise, then a small perceptron."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

SCALE_FLOOR = 0.05
"""Least scale [feature unit; rad; m]: what hardly varies in training must not become noise."""


@contextmanager
def one_thread() -> Iterator[None]:
    """Run torch on one thread inside: sums get one order, and workers do not fight for cores."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


class DecisionNetwork(nn.Module):
    """Inputs (n, F) -> logits (n, A); the normaliser is part of the weights.

    Double precision: with a few hundred samples it costs little, and equal training sets give equal
    parameters however their samples are ordered.
    """

    mean: torch.Tensor
    scale: torch.Tensor

    def __init__(self, n_inputs: int, hidden: tuple[int, ...], n_actions: int, seed: int) -> None:
        """Draw the initial weights from a generator of their own, seeded with `seed`."""
        super().__init__()
        self.hidden = hidden
        self.register_buffer("mean", torch.zeros(n_inputs, dtype=torch.float64))
        self.register_buffer("scale", torch.ones(n_inputs, dtype=torch.float64))
        layers: list[nn.Module] = []
        width = n_inputs
        for units in hidden:
            layers += [nn.Linear(width, units, dtype=torch.float64), nn.ReLU()]
            width = units
        layers.append(nn.Linear(width, n_actions, dtype=torch.float64))
        self.layers = nn.Sequential(*layers)
        self._initialise(torch.Generator().manual_seed(seed))

    def _initialise(self, generator: torch.Generator) -> None:
        """He et al. (2015) for the hidden layers, zero for the last: it begins undecided."""
        for layer in self.layers:
            if isinstance(layer, nn.Linear):
                nn.init.kaiming_normal_(layer.weight, generator=generator)
                nn.init.zeros_(layer.bias)
        nn.init.zeros_(self.layers[-1].weight)  # type: ignore[arg-type]

    def standardise(self, mean: NDArray[np.float64], deviation: NDArray[np.float64]) -> None:
        """Set the normaliser from the moments of the training inputs, each (F,)."""
        self.mean.copy_(torch.from_numpy(mean))
        self.scale.copy_(torch.from_numpy(np.hypot(deviation, SCALE_FLOOR)))

    def forward(self, inputs: torch.Tensor) -> torch.Tensor:
        """Return logits (n, A) float64."""
        logits: torch.Tensor = self.layers((inputs.double() - self.mean) / self.scale)
        return logits

    def shape(self) -> dict[str, object]:
        """Describe the sizes needed to build the network again."""
        return {"inputs": len(self.mean), "hidden": list(self.hidden)}
