"""A network that plans joint targets from the last states of an episode."""

from collections.abc import Mapping
from typing import ClassVar

import torch
from torch import Tensor, nn

from policies.learners.joints.networks import ChunkNetwork, HiddenState, PlanShape
from policies.learners.networks import cleared


class RecurrentPlanNetwork(ChunkNetwork):
    """The networks of `ChunkNetwork`, which also see what an LSTM reads from the last states."""

    kind: ClassVar[str] = "recurrent chunks"

    def __init__(
        self, shape: PlanShape, seed: int, ensemble: float, hidden: int, horizon: int
    ) -> None:
        """Draw the initial weights from a generator of their own, seeded with `seed`.

        Args:
            shape: Sizes.
            seed: Seed of the initial weights.
            ensemble: Weight of the plan of the step before in the joined plan.
            hidden: H, size of the LSTM.
            horizon: Control steps after which the memory is cleared.
        """
        self.hidden, self.horizon = hidden, horizon
        super().__init__(shape, seed, ensemble)

    def _make_memory(self, random: torch.Generator) -> int:
        self.lstm = nn.LSTM(self.shape.inputs, self.hidden, batch_first=True)
        for parameter in self.lstm.parameters():
            nn.init.uniform_(parameter, -(self.hidden**-0.5), self.hidden**-0.5, generator=random)
        return self.hidden

    @property
    def settings(self) -> Mapping[str, float]:
        """Weight of earlier plans, size of the memory, and when it is cleared."""
        return {"ensemble": self.ensemble, "hidden": self.hidden, "horizon": self.horizon}

    @property
    def memory(self) -> tuple[int, ...]:
        """Sizes of the hidden state: output, cell, and the steps since it was cleared."""
        return self.hidden, self.hidden, 1

    def read(self, inputs: Tensor, hidden: HiddenState | None) -> tuple[Tensor, HiddenState]:
        """Return normalised inputs (n, T, I) and what is remembered, (n, T, I + H), and its state.

        `hidden` is output and cell before the first input, (n, H) each.
        """
        before = None if hidden is None else (hidden[0][None], hidden[1][None])
        read, (output, cell) = self.lstm(inputs, before)
        return torch.cat([inputs, read], dim=2), (output[0], cell[0])

    def plan(
        self, inputs: Tensor, subtasks: Tensor | None, hidden: HiddenState | None
    ) -> tuple[Tensor, Tensor, HiddenState]:
        """Return logits of the sub-tasks (n, E), targets (n, K, J), and the next hidden state."""
        given = self.normaliser.inputs(inputs)
        taken = given.new_zeros(len(given), 1)
        if hidden is not None:
            hidden = cleared(hidden, self.horizon)
            taken = hidden[-1]
        seen, after = self.read(given[:, None], hidden)
        logits, planned = self._chosen(seen[:, 0], subtasks)
        return logits, planned, (*after, taken + 1)
