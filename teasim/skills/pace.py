"""How a demonstration is drawn out to a length that says nothing about what was done in it."""

from collections.abc import Sequence
from types import MappingProxyType

import numpy as np

from teasim.skills.arm import Style

MATCHED_SECONDS = (96.0, 112.0)
"""Length-matched demonstrations last uniformly between these [s], whatever happens in them."""

TYPICAL_SECONDS = MappingProxyType(
    {
        "turn_on_oven": 6.5,
        "add_water": 14.4,
        "add_sugar": 13.3,
        "add_milk": 13.8,
        "add_tea_bag": 7.6,
        "stir": 11.4,
        "turn_off_oven": 9.1,
    }
)
"""What a sub-task takes at the default tempo [s]; the sum is a demonstration."""


class Pace:
    """Rests between sub-tasks that make a demonstration last as long as it is meant to."""

    def __init__(self, steps: Sequence[str], length: float, rng: np.random.Generator) -> None:
        """Plan rests of random shares before each of `steps`, for `length` seconds in all."""
        self._expected = [TYPICAL_SECONDS[name] for name in steps]
        self._shares = rng.dirichlet(np.full(len(steps) + 1, 2.0))
        self.length = length

    def rest(self, position: int, elapsed: float, style: Style) -> float:
        """Seconds to rest before step number `position`, `elapsed` seconds after the start."""
        left = sum(self._expected[position:]) * Style().tempo / style.tempo
        share = self._shares[position] / self._shares[position:].sum()
        return float(max(self.length - elapsed - left, 0.0) * share)
