"""Rests that give demonstrations a length independent of the sub-tasks in them."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from teasim.constants import ARMS, CONTROL_TIMESTEP
from teasim.skills.style import Style
from teasim.task.subtasks import ROWS
from teasim.world.bodies.embodiments import EMBODIMENTS
from teasim.world.simulation import Simulation

STRETCH = (1.3, 1.5)
"""Length-matched demonstrations last between these multiples of Seq_1's typical length."""

TYPICAL_SECONDS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {name: MappingProxyType({row.name: row.seconds[name] for row in ROWS}) for name in EMBODIMENTS}
)
"""Typical duration of every sub-task by embodiment, at the default tempo [s]."""

IDLE_REACH = 0.4
"""Amplitude with which an idle arm sways, in units of the embodiment's `bow` [rad or m]."""
IDLE_PERIOD = 2.5
"""Approximate time in which an idle arm sways out and back [s]."""


def idle(simulation: Simulation, seconds: float, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Yield targets that wait for `seconds` [s] while both arms sway to the sides.

    The arms move because a rest without motion would reveal how much was left out.
    """
    steps = round(seconds / CONTROL_TIMESTEP)
    if not steps:
        return  # before anything is drawn: without a length to match, the rest stays the same
    sways = max(round(seconds / IDLE_PERIOD), 1)
    start, bow = simulation.target.copy(), simulation.embodiment.bow
    reach = IDLE_REACH * rng.uniform(0.7, 1.3, size=(len(ARMS), 1)) * rng.choice([-1, 1], (2, 1))
    for step in range(1, steps + 1):
        turns = sways * step / steps
        side = 1 if int(np.ceil(turns)) % 2 else -1  # to one side, then to the other
        out = side * (1 - np.cos(2 * np.pi * turns)) / 2
        target = start.copy()
        target[: -len(ARMS)] += (out * reach * bow).ravel()
        yield target


class Pace:
    """Rests between sub-tasks that bring a demonstration to its planned length."""

    def __init__(self, steps: Sequence[str], embodiment: str, rng: np.random.Generator) -> None:
        """Draw the length, and the shares of it that are rests before each of `steps`."""
        typical = TYPICAL_SECONDS[embodiment]
        self._expected = [typical[name] for name in steps]
        self.length = float(rng.uniform(*STRETCH) * sum(typical.values()))
        """Planned length of the demonstration [s]."""
        self._shares = rng.dirichlet(np.full(len(steps) + 1, 2.0))

    def rest(self, position: int, elapsed: float, style: Style) -> float:
        """Return the rest before step `position` [s], `elapsed` seconds after the start."""
        left = sum(self._expected[position:]) * Style().tempo / style.tempo
        share = self._shares[position] / self._shares[position:].sum()
        return float(max(self.length - elapsed - left, 0.0) * share)
