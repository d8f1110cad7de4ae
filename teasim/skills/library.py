"""Every sub-task's skill: which arm does it, and how."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

from teasim.skills.arm import Arm, Motion, Style
from teasim.skills.knob import turn_off_oven, turn_on_oven
from teasim.skills.pour import add_milk, add_sugar, add_water
from teasim.skills.stir import stir
from teasim.skills.tea_bag import add_tea_bag
from teasim.task.mistakes import WELL, Manner
from teasim.task.recipes import check_subtask
from teasim.world.simulation import Simulation


@dataclass(frozen=True)
class Skill:
    """A sub-task as one arm carries it out."""

    arm: str
    """The arm that can reach what is needed."""
    motion: Callable[[Arm, Manner], Motion]
    """Generator of targets, from READY back to READY, done well or in a mistaken manner."""
    postures: tuple[tuple[float, ...], ...] = ()
    """Joint angles YuMi's arm may stay near [rad], kinematic order, best first; default READY."""


# Found by random search over 60 layouts: the whole path from the grasp to the full tilt stays
# inside the soft limits, and no joint has to hurry. From READY the elbow runs into its limit.
KETTLE_POSTURES = ((1.61, -2.00, -1.65, 0.48, -0.81, -0.17, 1.86),)
SUGAR_POSTURES = (
    (-0.40, -1.89, 0.97, 0.01, -0.19, 0.45, 0.82),
    (-0.78, -2.35, 1.04, 0.62, -0.59, 1.50, 0.21),
)
MILK_POSTURES = (
    (-1.48, -2.08, 0.60, 0.65, 1.80, 1.17, 0.35),
    (-1.36, -1.49, 2.11, 0.25, 1.04, 0.77, -0.35),
    (-1.07, -2.15, 0.75, 0.14, 1.32, 1.95, 1.56),
)

SKILLS: Mapping[str, Skill] = MappingProxyType(
    {
        "turn_on_oven": Skill("right", turn_on_oven),
        "add_water": Skill("right", add_water, KETTLE_POSTURES),
        "add_sugar": Skill("left", add_sugar, SUGAR_POSTURES),
        "add_milk": Skill("left", add_milk, MILK_POSTURES),
        "add_tea_bag": Skill("left", add_tea_bag),
        "stir": Skill("left", stir),
        "turn_off_oven": Skill("right", turn_off_oven),
    }
)


def perform(subtask: str, simulation: Simulation, style: Style, manner: Manner = WELL) -> Motion:
    """Targets that carry out `subtask`; feed each to `simulation.step` before the next.

    Raises:
        ConfigError: there is no such sub-task.
        SkillError: while iterating, when it cannot be done from the present state.
    """
    skill = SKILLS[check_subtask(subtask)]
    body = simulation.embodiment
    side = style.hand if style.hand and subtask in body.either_hand else skill.arm
    arm = Arm(side, simulation, style, skill.postures if body.name == "yumi" else ())
    yield from arm.wait(style.pause)
    yield from skill.motion(arm, manner)
