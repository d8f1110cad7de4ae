"""A network that plans joint targets from the last states of an episode."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import ClassVar

import torch
from torch import Tensor, nn

from policies.learners.joints.networks import HiddenState, Normaliser, PlanShape, Residual
from policies.learners.joints.steps.switches import MOST_VALUES


@dataclass(frozen=True)
class Memory:
    """What is remembered from one control step to the next."""

    hidden: int
    """H, size of the LSTM."""
    horizon: int
    """Control steps after which it is cleared."""


class RecurrentPlanNetwork(nn.Module):
    """An LSTM beside the state; a residual network plans a chunk from both."""

    kind: ClassVar[str] = "recurrent chunks"
    values: Tensor

    def __init__(self, shape: PlanShape, seed: int, ensemble: float, **memory: int) -> None:
        """Draw the initial weights from a generator of their own, seeded with `seed`.

        `memory` has the fields of `Memory`.
        """
        super().__init__()
        self.shape, self.ensemble, self.remembered = shape, ensemble, Memory(**memory)
        hidden = self.remembered.hidden
        random = torch.Generator().manual_seed(seed)
        self.normaliser = Normaliser(shape)
        self.register_buffer("values", torch.full((shape.actions, MOST_VALUES), torch.nan))
        self.lstm = nn.LSTM(shape.inputs, hidden, batch_first=True)
        for parameter in self.lstm.parameters():
            nn.init.uniform_(parameter, -(hidden**-0.5), hidden**-0.5, generator=random)
        planned = shape.chunk * shape.actions
        sizes = shape.inputs + hidden, shape.width, shape.blocks, shape.subtasks + planned
        self.head = Residual(1, sizes, random)

    @property
    def settings(self) -> Mapping[str, float]:
        """Weight of earlier plans, and what is remembered."""
        return {"ensemble": self.ensemble, **asdict(self.remembered)}

    @property
    def memory(self) -> tuple[int, ...]:
        """Sizes of the hidden state: output, cell, and the steps since it was cleared."""
        return self.remembered.hidden, self.remembered.hidden, 1

    def forward(
        self, inputs: Tensor, hidden: HiddenState | None
    ) -> tuple[Tensor, Tensor, HiddenState]:
        """Return logits (n, T, E), normalised targets (n, T, K, J), and the last hidden state.

        `inputs` (n, T, I) are normalised.
        """
        before = None if hidden is None else (hidden[0][None], hidden[1][None])
        read, (output, cell) = self.lstm(inputs, before)
        found = self.head(torch.cat([inputs, read], dim=2).flatten(0, 1)[None])[0]
        found = found.view(*read.shape[:2], -1)
        logits, planned = found[..., : self.shape.subtasks], found[..., self.shape.subtasks :]
        return (
            logits,
            planned.reshape(*read.shape[:2], self.shape.chunk, self.shape.actions),
            (output[0], cell[0]),
        )

    def plan(
        self,
        inputs: Tensor,
        subtasks: Tensor | None,  # noqa: ARG002  (the protocol's)
        hidden: HiddenState | None,
    ) -> tuple[Tensor, Tensor, HiddenState]:
        """Return logits of the sub-tasks (n, E), targets (n, K, J), and the next hidden state."""
        given = self.normaliser.inputs(inputs)[:, None]
        taken = given.new_zeros(len(given), 1)
        if hidden is not None:
            goes_on = hidden[-1] < self.remembered.horizon
            taken = hidden[-1] * goes_on
            hidden = tuple(part * goes_on for part in hidden[:2])
        logits, planned, after = self(given, hidden)
        return logits[:, 0], self.normaliser.restored(planned[:, 0]), (*after, taken + 1)
