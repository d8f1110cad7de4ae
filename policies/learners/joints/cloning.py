"""Behaviour cloning of joint targets by networks that remember nothing but their own plans."""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn.functional import cross_entropy

from policies.learners.joints.descent import PlanConfig, descend
from policies.learners.joints.networks import ChunkNetwork, PlanShape
from policies.learners.joints.steps.rows import Rows

EARLY_OR_LATE = 8
"""Control steps before and after a sub-task from which its network learns too, so that it knows
what to do when the sub-task is told too early or too late."""
BEFORE_A_SWITCH = 12
"""Control steps before a gripper opens or closes that are emphasised."""
SCALED_ON = 4096
"""Control steps from which the scales are measured."""


def clone_chunks(
    rows: Rows, subtasks: int, config: PlanConfig
) -> tuple[ChunkNetwork, tuple[float, ...]]:
    """Return a network that was trained on `rows`, and its losses.

    Args:
        rows: Control steps.
        subtasks: E, number of sub-tasks that are told apart; 1 for none.
        config: Sizes, and settings of the descent.
    """
    draws = Draws(rows, subtasks, config)
    network = ChunkNetwork(shape_for(rows, subtasks, config), config.seed, config.ensemble)
    prepare_network(network, rows, draws)

    def loss(_: int) -> Tensor:
        chosen = draws.batch()
        flat = chosen.ravel()
        given = network.normaliser.inputs(torch.from_numpy(rows.given[flat]))
        wanted = torch.from_numpy(rows.planned(flat, config.chunk))
        planned = network(given.view(*chosen.shape, -1)).flatten(0, 1)
        missed = (planned - network.normaliser.targets(wanted)).abs().mean()
        if subtasks == 1:
            return missed
        return missed + cross_entropy(network.tell(given), torch.from_numpy(rows.subtasks[flat]))

    return network, descend(network, loss, config)


class Draws:
    """Draws control steps for the network of each sub-task, with replacement."""

    def __init__(self, rows: Rows, subtasks: int, config: PlanConfig) -> None:
        """Weigh the rows: by demonstration, and more before a switch changes."""
        self._random = np.random.default_rng(config.seed)
        self._rows, self._batch = rows, config.batch
        lengths = np.diff(rows.stops, prepend=0)
        weights = np.repeat(rows.shares / lengths, lengths)
        weights[_before_a_switch(rows)] *= config.emphasis
        everything = [np.ones(len(weights), dtype=np.bool_)]
        parts = [rows.subtasks == number for number in range(subtasks)]
        self._chances = [
            np.cumsum(np.where(part if part.any() else True, weights, 0.0))
            for part in (parts if subtasks > 1 else everything)
        ]

    def batch(self) -> NDArray[np.int64]:
        """Return rows (E, n), n for each sub-task."""
        drawn = self._random.random((len(self._chances), self._batch))
        pairs = zip(self._chances, drawn, strict=True)
        rows = np.stack([np.searchsorted(chance, u * chance[-1], "right") for chance, u in pairs])
        shift = self._random.integers(-EARLY_OR_LATE, EARLY_OR_LATE, rows.shape, endpoint=True)
        demos = np.searchsorted(self._rows.stops, rows, side="right")
        return np.clip(rows + shift, self._rows.starts[demos], self._rows.stops[demos] - 1)


def shape_for(rows: Rows, subtasks: int, config: PlanConfig) -> PlanShape:
    """Return the sizes of a network for `rows`."""
    return PlanShape(
        inputs=rows.given.shape[1],
        actions=rows.targets.shape[1],
        chunk=config.chunk,
        subtasks=subtasks,
        width=config.width,
        blocks=config.blocks,
    )


def prepare_network(network: ChunkNetwork, rows: Rows, draws: Draws) -> None:
    """Set what `network` does not learn: scales, values of the switches, and what is relevant."""
    size = draws.batch().size
    some = np.concatenate([draws.batch().ravel() for _ in range(1 + SCALED_ON // size)])
    given, wanted = rows.given[some], rows.planned(some, network.shape.chunk)
    network.normaliser.fit(given, wanted, rows.switches)
    for place, values in rows.values.items():
        network.values[place, : len(values)] = torch.from_numpy(values)
    if network.shape.subtasks > 1:
        network.relevant.copy_(torch.from_numpy(rows.relevant))


def _before_a_switch(rows: Rows) -> NDArray[np.bool_]:
    """Return which rows are followed by a change of a switch within a short time, (n,)."""
    commands = rows.targets[:, rows.switches]
    changes = np.abs(np.diff(commands, axis=0, prepend=commands[:1])).sum(axis=1) > 0
    changes[rows.starts] = False
    later = np.convolve(changes[::-1], np.ones(BEFORE_A_SWITCH + 1))[: len(changes)][::-1]
    return np.asarray(later > 0.5)
