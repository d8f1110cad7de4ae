"""The sub-tasks: one row each with everything the rest of the program has to know about it.

Indices in pools, precedence, sequences, mistakes, event recognition, skills and lengths are derived
from these rows. A new sub-task is a new last row and the function that carries it out.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import radians
from types import MappingProxyType

from teasim.common.registry import named

KNOB_ON = radians(60)
"""The oven is on once its knob has been turned beyond this angle [rad]."""
KNOB_OFF = radians(20)
"""The oven is off once its knob has been turned back below this angle [rad]."""


@dataclass(frozen=True)
class Turned:
    """A joint reaches an angle; the event counts again after the joint has been set back."""

    joint: str
    """Name of the joint in the model."""
    reached: float
    """Angle that has to be passed [rad]."""
    set_back: float
    """Angle that has to be passed in the other direction before the event can happen again [rad].
    The event is a turn in positive direction if it is the smaller angle, else in negative one."""


@dataclass(frozen=True)
class Poured:
    """A serving of a content has reached the cup."""

    content: str
    """Content of one of `teasim.world.liquids.VESSELS`."""
    liquid: bool = True
    """Whether it can be stirred."""


@dataclass(frozen=True)
class Dropped:
    """A thing lies in the cup and no gripper touches it."""

    thing: str
    """Name of the thing."""


@dataclass(frozen=True)
class Stirred:
    """A site of the model has gone round in the liquid in the cup."""

    site: str
    """Name of the site in the model."""


Event = Turned | Poured | Dropped | Stirred
"""Physical events that say that a sub-task is done; `teasim.world.events` watches for them."""


@dataclass(frozen=True)
class Subtask:
    """One sub-task."""

    name: str
    """Name in pools, environments and options."""
    event: Event
    """Physical event that completes it."""
    waits_for: tuple[str, ...]
    """Sub-tasks that must be done before it in a correct demonstration."""
    seq_1: int
    """Rank in Seq_1, the optimal order. The last sub-task of Seq_1 must be done last."""
    seq_2: int
    """Rank in Seq_2, the sub-optimal order."""
    arm: str
    """Side of the arm that does it, "right" or "left"."""
    skill: str
    """Function that carries it out, as "module:function" of `teasim.skills`."""
    segment: str
    """Name of the thing it handles in segmentation masks."""
    seconds: Mapping[str, float]
    """Typical duration by embodiment, at the default tempo [s]."""
    either_hand: bool = False
    """Whether a body with equal hands may use the other hand as well."""
    oven: bool | None = None
    """Whether it turns the oven on or off; None if neither."""
    misses: bool = False
    """Whether it misses the cup, and spills, when it is carried out ineffectively."""
    critical: bool = False
    """Whether Seq_3 may leave it out."""
    optional: bool = False
    """Whether a pool may say that a correct demonstration can do without it."""
    once: bool = False
    """Whether it cannot be done twice."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "seconds", MappingProxyType(dict(self.seconds)))

    @property
    def content(self) -> str | None:
        """What it pours into the cup; None if nothing."""
        return self.event.content if isinstance(self.event, Poured) else None


ROWS = (
    Subtask(
        "turn_on_oven",
        event=Turned("knob", reached=KNOB_ON, set_back=KNOB_OFF),
        waits_for=(),
        seq_1=10,
        seq_2=10,
        arm="right",
        skill="knob:turn_on_oven",
        segment="knob",
        seconds={"yumi": 6.5, "person": 5.0},
        oven=True,
    ),
    Subtask(
        "add_water",
        event=Poured("water"),
        waits_for=("turn_off_oven",),
        seq_1=60,
        seq_2=60,
        arm="right",
        skill="pour:add_water",
        segment="kettle",
        seconds={"yumi": 14.4, "person": 11.8},
        misses=True,
        critical=True,
    ),
    Subtask(
        "add_sugar",
        event=Poured("sugar", liquid=False),
        waits_for=("turn_on_oven",),
        seq_1=30,
        seq_2=20,
        arm="left",
        skill="pour:add_sugar",
        segment="sugar_pot",
        seconds={"yumi": 13.3, "person": 10.2},
        misses=True,
        optional=True,
    ),
    Subtask(
        "add_milk",
        event=Poured("milk"),
        waits_for=("turn_on_oven",),
        seq_1=40,
        seq_2=30,
        arm="left",
        skill="pour:add_milk",
        segment="milk_jug",
        seconds={"yumi": 13.8, "person": 9.8},
        optional=True,
    ),
    Subtask(
        "add_tea_bag",
        event=Dropped("tea_bag"),
        waits_for=("turn_on_oven",),
        seq_1=20,
        seq_2=40,
        arm="left",
        skill="tea_bag:add_tea_bag",
        segment="tea_bag",
        seconds={"yumi": 7.6, "person": 8.1},
        either_hand=True,
        critical=True,
        once=True,  # there is a single tea bag
    ),
    Subtask(
        "stir",
        event=Stirred("spoon/tip"),
        waits_for=("add_tea_bag", "add_sugar", "add_milk", "add_water"),
        seq_1=70,
        seq_2=70,
        arm="left",
        skill="stir:stir",
        segment="spoon",
        seconds={"yumi": 11.4, "person": 11.8},
        either_hand=True,
    ),
    Subtask(
        "turn_off_oven",
        event=Turned("knob", reached=KNOB_OFF, set_back=KNOB_ON),
        waits_for=("turn_on_oven",),
        seq_1=50,
        seq_2=50,
        arm="right",
        skill="knob:turn_off_oven",
        segment="knob",
        seconds={"yumi": 9.1, "person": 5.3},
        oven=False,
        critical=True,
    ),
)
"""All sub-tasks; the position is the index in pools and environments, so new rows go last."""

REGISTRY: Mapping[str, Subtask] = MappingProxyType({row.name: row for row in ROWS})
"""The rows by name."""


def find_subtask(name: str) -> Subtask:
    """Return the row of a sub-task.

    Raises:
        ConfigError: there is no such sub-task.
    """
    return named("sub-task", REGISTRY, name)
