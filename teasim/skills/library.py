"""The skill of every sub-task: which arm carries it out, and how."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from types import MappingProxyType

from teasim.skills.arm import Arm, Motion
from teasim.skills.style import Style
from teasim.task.mistakes import WELL, Manner
from teasim.task.subtasks import ROWS, Subtask, find_subtask
from teasim.world.simulation import Simulation


@dataclass(frozen=True)
class Skill:
    """A sub-task as one arm carries it out."""

    arm: str
    """The arm that can reach what is needed."""
    motion: Callable[[Arm, Manner], Motion]
    """Generator of targets, from READY back to READY, done well or in a mistaken manner."""
    either_hand: bool
    """Whether a body with equal hands may use the other arm as well."""


def _skill(row: Subtask) -> Skill:
    module, _, function = row.skill.partition(":")
    motion = getattr(import_module(f"teasim.skills.{module}"), function)
    return Skill(row.arm, motion, row.either_hand)


SKILLS: Mapping[str, Skill] = MappingProxyType({row.name: _skill(row) for row in ROWS})
"""The skill of every sub-task."""


def perform(subtask: str, simulation: Simulation, style: Style, manner: Manner = WELL) -> Motion:
    """Yield targets that carry out `subtask`; pass each to `simulation.step` before the next.

    Raises:
        ConfigError: there is no such sub-task.
        SkillError: while iterating, when it cannot be done from the present state.
    """
    skill = SKILLS[find_subtask(subtask).name]
    body = simulation.embodiment
    free = skill.either_hand and body.equal_hands
    side = style.hand if style.hand and free else skill.arm
    arm = Arm(side, simulation, style, body.postures.get(subtask, ()))
    yield from arm.wait(style.pause)
    yield from skill.motion(arm, manner)
