"""How a demonstration is drawn out to a length that says nothing about what was done in it."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType

import numpy as np

from teasim.constants import ARMS, CONTROL_TIMESTEP
from teasim.skills.arm import Style
from teasim.world.simulation import Simulation

STRETCH = (1.3, 1.5)
"""Length-matched demonstrations last uniformly between these, in typical lengths of Seq_1."""

TYPICAL_SECONDS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "yumi": {
            "turn_on_oven": 6.5,
            "add_water": 14.4,
            "add_sugar": 13.3,
            "add_milk": 13.8,
            "add_tea_bag": 7.6,
            "stir": 11.4,
            "turn_off_oven": 9.1,
        },
        "person": {
            "turn_on_oven": 5.0,
            "add_water": 11.8,
            "add_sugar": 10.2,
            "add_milk": 9.8,
            "add_tea_bag": 8.1,
            "stir": 11.8,
            "turn_off_oven": 5.3,
        },
    }
)
"""What a sub-task takes each embodiment at the default tempo [s]."""


IDLE_REACH = 0.4
"""How far an idle arm sways, in units of the embodiment's `bow` [rad or m]."""
IDLE_PERIOD = 2.5
"""Time an idle arm takes to sway out and back [s], roughly."""


def idle(simulation: Simulation, seconds: float, rng: np.random.Generator) -> Iterator[np.ndarray]:
    """Targets of somebody who waits for `seconds`: both arms sway to the sides.

    Nobody who is drawn out to a length stands still: resting would show as little motion, and
    little motion would tell how much was left out.
    """
    steps = round(seconds / CONTROL_TIMESTEP)
    if not steps:
        return  # and nothing is drawn: without a length to match, a seed gives what it always gave
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
    """Rests between sub-tasks that make a demonstration last as long as it is meant to."""

    def __init__(self, steps: Sequence[str], embodiment: str, rng: np.random.Generator) -> None:
        """Draw the length and the shares of it that are rests before each of `steps`."""
        typical = TYPICAL_SECONDS[embodiment]
        self._expected = [typical[name] for name in steps]
        self.length = float(rng.uniform(*STRETCH) * sum(typical.values()))
        """How long the demonstration is to last [s]."""
        self._shares = rng.dirichlet(np.full(len(steps) + 1, 2.0))

    def rest(self, position: int, elapsed: float, style: Style) -> float:
        """Seconds to rest before step number `position`, `elapsed` seconds after the start."""
        left = sum(self._expected[position:]) * Style().tempo / style.tempo
        share = self._shares[position] / self._shares[position:].sum()
        return float(max(self.length - elapsed - left, 0.0) * share)
