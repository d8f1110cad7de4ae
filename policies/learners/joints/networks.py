"""Networks that plan the next joint targets from the state.

A target is planned as its distance from the measured position, in units of the typical distance of
a target so many steps ahead; the target of a switch (`switches`) is planned itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn.functional import gelu, layer_norm, pad

from policies.learners.joints.steps.switches import MOST_VALUES

INPUT_SCALE_FLOOR = 0.01
"""Least scale of an input [its unit]: less is the jitter of things at rest."""
TARGET_SCALE_FLOOR = 0.005
"""Least scale of a target [rad; m for grippers]: less is the execution noise of an arm at rest."""

HiddenState = tuple[Tensor, ...]
"""What a network carries from one control step to the next, (n, H) each; () if nothing."""


@dataclass(frozen=True)
class PlanShape:
    """Sizes of a network that plans joint targets."""

    inputs: int
    """I, numbers it is given."""
    actions: int
    """J, joint targets."""
    chunk: int
    """K, control steps it plans ahead."""
    subtasks: int
    """E, sub-tasks it tells apart; 1: none."""
    width: int
    """W, size of its layers."""
    blocks: int
    """Residual blocks of two layers each."""


class PlanNetwork(Protocol):
    """What a policy needs of its network."""

    kind: ClassVar[str]
    """Name under which it is saved."""
    shape: PlanShape
    """Its sizes."""
    values: Tensor
    """Values of each switch, filled up with nan; all nan for other targets.  # (J, 16)"""
    normaliser: "Normaliser"
    """Scales of its inputs and targets."""
    ensemble: float
    """Weight of the plan of the step before in the joined plan."""

    @property
    def memory(self) -> tuple[int, ...]:
        """Sizes H of the parts of its hidden state."""

    def plan(
        self, inputs: Tensor, subtasks: Tensor | None, hidden: HiddenState | None
    ) -> tuple[Tensor, Tensor, HiddenState]:
        """Return logits of the sub-tasks (n, E), targets (n, K, J), and the next hidden state.

        Targets of joints are relative to their measured positions. `subtasks` (n,) are planned for;
        by default the most probable ones are.
        """

    def eval(self) -> nn.Module: ...  # noqa: D102  (torch's)


class Normaliser(nn.Module):
    """Scales of inputs and targets; a part of the weights."""

    mean: Tensor
    scale: Tensor
    target_mean: Tensor
    target_scale: Tensor

    def __init__(self, shape: PlanShape) -> None:
        """Allocate the buffers of a network with `shape`."""
        super().__init__()
        self.register_buffer("mean", torch.zeros(shape.inputs))
        self.register_buffer("scale", torch.ones(shape.inputs))
        self.register_buffer("target_mean", torch.zeros(shape.actions))
        self.register_buffer("target_scale", torch.ones(shape.chunk, shape.actions))

    def fit(
        self, inputs: NDArray[np.float32], targets: NDArray[np.float32], switches: list[int]
    ) -> None:
        """Set the scales from representative inputs (n, I) and targets (n, K, J)."""
        self.mean.copy_(torch.from_numpy(inputs.mean(axis=0)))
        deviation = inputs.std(axis=0, dtype=np.float64)
        self.scale.copy_(torch.from_numpy(np.hypot(deviation, INPUT_SCALE_FLOOR)))
        middle = np.zeros(targets.shape[2])
        middle[switches] = targets[..., switches].mean(axis=(0, 1))
        spread = np.sqrt(np.square(targets - middle, dtype=np.float64).mean(axis=0))
        self.target_mean.copy_(torch.from_numpy(middle))
        self.target_scale.copy_(torch.from_numpy(np.hypot(spread, TARGET_SCALE_FLOOR)))

    def inputs(self, inputs: Tensor) -> Tensor:
        """Return inputs (..., I) at mean 0 and spread 1."""
        return (inputs - self.mean) / self.scale

    def targets(self, targets: Tensor) -> Tensor:
        """Return targets (..., K, J) at spread 1."""
        return (targets - self.target_mean) / self.target_scale

    def restored(self, planned: Tensor) -> Tensor:
        """Return normalised targets (..., K, J) in their units."""
        return planned * self.target_scale + self.target_mean


class Residual(nn.Module):
    """M residual networks beside one another: (M, n, I) -> (M, n, O).

    Each block adds W -> W -> W to what it is given, with layer normalisation before. The last layer
    starts at 0.
    """

    def __init__(self, members: int, sizes: tuple[int, int, int, int], random: torch.Generator):
        """Draw the weights of `members` networks from `random`; `sizes` are I, W, blocks and O."""
        super().__init__()
        inputs, width, blocks, outputs = sizes

        def layer(rows: int, columns: int, gain: float = 1.0) -> nn.ParameterList:
            start = torch.randn((members, rows, columns), generator=random) * gain / rows**0.5
            return nn.ParameterList([start, torch.zeros(members, 1, columns)])

        self.first = layer(inputs, width)
        self.blocks = nn.ModuleList(layer(width, width, 1.4) for _ in range(2 * blocks))
        self.last = layer(width, outputs, 0.0)

    def forward(self, inputs: Tensor, members: Tensor | None = None) -> Tensor:
        """Return the outputs (M, n, O), or (m, n, O) of the chosen `members` (m,) alone."""

        def apply(layer: nn.Module, given: Tensor) -> Tensor:
            weight, bias = layer[0], layer[1]  # type: ignore[index]
            if members is not None:
                weight, bias = weight[members], bias[members]
            return torch.baddbmm(bias, given, weight)

        here = apply(self.first, inputs)
        for number in range(0, len(self.blocks), 2):
            inner = apply(self.blocks[number], layer_norm(here, here.shape[-1:]))
            here = here + apply(self.blocks[number + 1], gelu(inner))
        return apply(self.last, layer_norm(here, here.shape[-1:]))


class ChunkNetwork(nn.Module):
    """One residual network per sub-task plans a chunk; another tells the sub-task."""

    kind: ClassVar[str] = "chunks"
    values: Tensor
    relevant: Tensor
    """1 for each input that the network of a sub-task is given, else 0.  # (E, I)"""

    def __init__(self, shape: PlanShape, seed: int, ensemble: float) -> None:
        """Draw the initial weights from a generator of their own, seeded with `seed`."""
        super().__init__()
        self.shape, self.ensemble = shape, ensemble
        random = torch.Generator().manual_seed(seed)
        self.normaliser = Normaliser(shape)
        self.register_buffer("values", torch.full((shape.actions, MOST_VALUES), torch.nan))
        self.register_buffer("relevant", torch.ones(shape.subtasks, shape.inputs))
        self.remembered = self._make_memory(random)
        seen, planned = shape.inputs + self.remembered, shape.chunk * shape.actions
        self.experts = Residual(shape.subtasks, (seen, shape.width, shape.blocks, planned), random)
        self.teller = Residual(1, (seen, shape.width, 1, shape.subtasks), random)

    def _make_memory(self, random: torch.Generator) -> int:  # noqa: ARG002  (for subclasses)
        """Return H, how many remembered numbers the networks are given after the inputs."""
        return 0

    @property
    def settings(self) -> Mapping[str, float]:
        """Weight of earlier plans."""
        return {"ensemble": self.ensemble}

    @property
    def memory(self) -> tuple[int, ...]:
        """It has no hidden state."""
        return ()

    def tell(self, seen: Tensor) -> Tensor:
        """Return logits of the sub-tasks (n, E) for normalised inputs and memory (n, I + H)."""
        logits: Tensor = self.teller(seen[None])[0]
        return logits

    def forward(self, seen: Tensor, members: Tensor | None = None) -> Tensor:
        """Return normalised targets (E, n, K, J) for normalised inputs and memory (E, n, I + H).

        With `members` (m,) only these sub-tasks are planned for, and E is m.
        """
        relevant = self.relevant if members is None else self.relevant[members]
        relevant = pad(relevant, (0, self.remembered), value=1.0)
        planned: Tensor = self.experts(seen * relevant[:, None], members)
        return planned.view(*planned.shape[:2], self.shape.chunk, self.shape.actions)

    def plan(
        self,
        inputs: Tensor,
        subtasks: Tensor | None,
        hidden: HiddenState | None,  # noqa: ARG002  (the protocol's)
    ) -> tuple[Tensor, Tensor, HiddenState]:
        """Return logits of the sub-tasks (n, E), targets (n, K, J), and an empty hidden state."""
        return *self._chosen(self.normaliser.inputs(inputs), subtasks), ()

    def _chosen(self, seen: Tensor, subtasks: Tensor | None) -> tuple[Tensor, Tensor]:
        """Return logits (n, E) and the targets (n, K, J) of the sub-tasks that are planned for."""
        logits = self.tell(seen)
        chosen = logits.argmax(dim=1) if subtasks is None else subtasks
        return logits, self.normaliser.restored(self(seen[:, None], chosen)[:, 0])
