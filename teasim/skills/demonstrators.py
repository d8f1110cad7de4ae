"""The participants: variation of tempo, path and order that is not a mistake."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from teasim.common.errors import ConfigError
from teasim.constants import ARMS
from teasim.skills.style import Style
from teasim.task.recipes import SEQ_1, is_legal, moved
from teasim.world.bodies.embodiments import EMBODIMENTS
from teasim.world.bodies.person import Appearance

Range = tuple[float, float]


@dataclass(frozen=True)
class Participant:
    """A demonstrator with habits: the ranges from which styles are drawn."""

    name: str
    """Name in the registry."""
    embodiment: str
    """The body that carries out the skills."""
    tempo: Range
    """Speed of all motions relative to the nominal one."""
    lift: Range
    """Height by which things are lifted before they are carried [m]."""
    bow: Range
    """Sideways bow of the free motions [rad or m]."""
    pause: Range
    """Rest before each sub-task [s]."""
    stir_turns: Range
    """Turns of the spoon in the cup."""
    appearance: Appearance | None = None
    """Colours of skin and clothes; None for a robot."""
    hand: str | None = None
    """Preferred hand where the body can use either; None if it has no choice."""
    hesitates: float = 0.0
    """Probability per sub-task that the hand stops in front of a thing."""
    regrasps: float = 0.0
    """Probability per sub-task that a thing is grasped twice."""
    orders: tuple[tuple[str, ...], ...] = (SEQ_1,)
    """Habitual correct orders, the most usual one first."""

    def __post_init__(self) -> None:
        """Check the habits.

        Raises:
            ConfigError: unknown embodiment or hand, or an order that is not correct.
        """
        if self.embodiment not in EMBODIMENTS:
            raise ConfigError(
                f"{self.name} has the unknown embodiment '{self.embodiment}'; "
                f"choose {', '.join(EMBODIMENTS)}."
            )
        if self.hand not in (None, *ARMS):
            raise ConfigError(
                f"{self.name} has the unknown hand '{self.hand}'; choose {', '.join(ARMS)}."
            )
        for order in self.orders:
            if not is_legal(order):
                raise ConfigError(f"{self.name} has an order that is not correct: {order}.")


_HESITATION = (0.4, 1.0)  # [s]

OPERATOR = Participant(
    "yumi",
    embodiment="yumi",
    tempo=(1.5, 1.9),
    lift=(0.065, 0.085),
    bow=(-0.06, 0.06),
    pause=(0.2, 0.6),
    stir_turns=(2.6, 3.6),
    hesitates=0.06,
    regrasps=0.04,
)
"""The robot, led by its only operator."""

_SUGAR_LAST = moved(SEQ_1, "add_sugar", after="add_milk")
_OFF_EARLY = moved(SEQ_1, "turn_off_oven", after="add_tea_bag")
_WATER_EARLY = moved(_OFF_EARLY, "add_water", after="turn_off_oven")
_MILK_LAST = moved(SEQ_1, "add_milk", after="add_water")

_PEOPLE = (
    Participant(
        "person_1",
        embodiment="person",
        appearance=Appearance((0.87, 0.66, 0.54), (0.24, 0.35, 0.56), (0.24, 0.35, 0.56)),
        tempo=(1.8, 2.1),
        lift=(0.070, 0.090),
        bow=(-0.06, 0.06),
        pause=(0.2, 0.5),
        stir_turns=(2.6, 3.4),
        hand="left",
        hesitates=0.08,
        regrasps=0.04,
        orders=(SEQ_1, _SUGAR_LAST),
    ),
    Participant(
        "person_2",
        embodiment="person",
        appearance=Appearance((0.47, 0.31, 0.22), (0.80, 0.78, 0.72), (0.62, 0.20, 0.22)),
        tempo=(1.95, 2.3),
        lift=(0.085, 0.105),
        bow=(0.0, 0.09),
        pause=(0.1, 0.3),
        stir_turns=(3.2, 4.2),
        hand="right",
        hesitates=0.04,
        regrasps=0.10,
        orders=(SEQ_1, _WATER_EARLY),
    ),
    Participant(
        "person_3",
        embodiment="person",
        appearance=Appearance((0.95, 0.78, 0.68), (0.22, 0.42, 0.30), (0.20, 0.22, 0.24)),
        tempo=(1.55, 1.8),
        lift=(0.065, 0.080),
        bow=(-0.09, 0.0),
        pause=(0.4, 0.9),
        stir_turns=(2.5, 3.0),
        hand="left",
        hesitates=0.18,
        regrasps=0.06,
        orders=(SEQ_1, _MILK_LAST, _SUGAR_LAST),
    ),
)

PARTICIPANTS: Mapping[str, Participant] = MappingProxyType(
    {participant.name: participant for participant in (OPERATOR, *_PEOPLE)}
)
"""All participants by name."""


def sample_style(rng: np.random.Generator, participant: Participant = OPERATOR) -> Style:
    """Draw the style of one demonstration by `participant`."""
    return Style(
        tempo=rng.uniform(*participant.tempo),
        lift=rng.uniform(*participant.lift),
        bow=rng.uniform(*participant.bow),
        pause=rng.uniform(*participant.pause),
        stir_turns=rng.uniform(*participant.stir_turns),
        hand=participant.hand,
    )


def varied(style: Style, rng: np.random.Generator, participant: Participant = OPERATOR) -> Style:
    """Draw the style of one sub-task, which varies around the demonstration's style."""
    tempo, pause = rng.uniform(0.94, 1.06), rng.uniform(0.7, 1.3)
    style = replace(style, tempo=style.tempo * tempo, pause=style.pause * pause)
    if participant.hesitates and rng.random() < participant.hesitates:
        style = replace(style, hesitation=rng.uniform(*_HESITATION))
    if participant.regrasps and rng.random() < participant.regrasps:
        style = replace(style, regrasp=True)
    return style
