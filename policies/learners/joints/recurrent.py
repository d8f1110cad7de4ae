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
    """An LSTM beside the state; one residual network per sub-task plans a chunk from both.

    Another residual network tells the sub-task. That of a sub-task sees of the state what matters
    for it, as in `networks.ChunkNetwork`.
    """

    kind: ClassVar[str] = "recurrent chunks"
    values: Tensor
    relevant: Tensor
    """1 for each input that the network of a sub-task is given, else 0.  # (E, I)"""

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
        self.register_buffer("relevant", torch.ones(shape.subtasks, shape.inputs))
        self.lstm = nn.LSTM(shape.inputs, hidden, batch_first=True)
        for parameter in self.lstm.parameters():
            nn.init.uniform_(parameter, -(hidden**-0.5), hidden**-0.5, generator=random)
        seen, planned = shape.inputs + hidden, shape.chunk * shape.actions
        self.experts = Residual(shape.subtasks, (seen, shape.width, shape.blocks, planned), random)
        self.teller = Residual(1, (seen, shape.width, 1, shape.subtasks), random)

    @property
    def settings(self) -> Mapping[str, float]:
        """Weight of earlier plans, and what is remembered."""
        return {"ensemble": self.ensemble, **asdict(self.remembered)}

    @property
    def memory(self) -> tuple[int, ...]:
        """Sizes of the hidden state: output, cell, and the steps since it was cleared."""
        return self.remembered.hidden, self.remembered.hidden, 1

    def read(self, inputs: Tensor, hidden: HiddenState | None) -> tuple[Tensor, HiddenState]:
        """Return what the LSTM reads from normalised inputs (n, T, I), (n, T, H), and its state."""
        before = None if hidden is None else (hidden[0][None], hidden[1][None])
        read, (output, cell) = self.lstm(inputs, before)
        return read, (output[0], cell[0])

    def tell(self, inputs: Tensor, read: Tensor) -> Tensor:
        """Return logits of the sub-tasks (n, E) for inputs (n, I) and what was read (n, H)."""
        logits: Tensor = self.teller(torch.cat([inputs, read], dim=1)[None])[0]
        return logits

    def forward(self, inputs: Tensor, read: Tensor, members: Tensor | None = None) -> Tensor:
        """Return normalised targets (E, n, K, J) for inputs (E, n, I) and what was read (E, n, H).

        With `members` (m,) only these sub-tasks are planned for, and E is m.
        """
        relevant = self.relevant if members is None else self.relevant[members]
        given = torch.cat([inputs * relevant[:, None], read], dim=2)
        planned: Tensor = self.experts(given, members)
        return planned.view(*planned.shape[:2], self.shape.chunk, self.shape.actions)

    def plan(
        self, inputs: Tensor, subtasks: Tensor | None, hidden: HiddenState | None
    ) -> tuple[Tensor, Tensor, HiddenState]:
        """Return logits of the sub-tasks (n, E), targets (n, K, J), and the next hidden state."""
        given = self.normaliser.inputs(inputs)
        taken = given.new_zeros(len(given), 1)
        if hidden is not None:
            goes_on = hidden[-1] < self.remembered.horizon
            taken = hidden[-1] * goes_on
            hidden = tuple(part * goes_on for part in hidden[:2])
        read, after = self.read(given[:, None], hidden)
        logits = self.tell(given, read[:, 0])
        chosen = logits.argmax(dim=1) if subtasks is None else subtasks
        planned = self(given[:, None], read, chosen)[:, 0]
        return logits, self.normaliser.restored(planned), (*after, taken + 1)
