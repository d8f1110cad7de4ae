"""The skill that lifts the tea bag by its tag and drops it into the cup."""

import numpy as np

from teasim.common.errors import SkillError
from teasim.skills.arm import Arm, Motion
from teasim.skills.geometry import DOWN, UP, pose, position, rotation, shifted, tool
from teasim.task.mistakes import ABANDONED, INEFFECTIVE, Manner
from teasim.world.station import body_name

OPENING = 0.024
"""Opening of the gripper around the tag [m]."""
CARRY_HEIGHT = 0.21
"""Height of the hand between holder and cup [m]; the bag passes above the spoon."""
DROP_HEIGHT = 0.095
"""Height of the hand above the cup's underside at the release [m]."""
BESIDE = np.array([0.10, 0.03, 0.0])
"""Place of the ineffective release relative to the cup (3,) [m]; the bag hinders no other skill."""


def add_tea_bag(arm: Arm, manner: Manner) -> Motion:
    """Put the tea bag into the cup; beside it if ineffective, back into its holder if abandoned.

    Raises:
        SkillError: the bag is in the cup already, or is not upright in its holder.
    """
    simulation = arm.simulation
    if simulation.recogniser.bag_in_cup:
        raise SkillError("The tea bag is in the cup already; choose another sub-task.")
    bag = simulation.data.body(body_name("tea_bag")).xmat.reshape(3, 3).copy()
    if bag[2, 2] < np.cos(np.radians(25)):
        raise SkillError("The tea bag does not stand in its holder; reset the station.")
    tag = simulation.data.site("tea_bag/grasp").xpos.copy()
    yield from arm.take(arm.easier(pose(tag, tool(DOWN, bag[:, 1]))), OPENING)
    home = arm.tcp
    up = shifted(home, (CARRY_HEIGHT - position(home)[2]) * UP)
    yield from arm.line(up)
    cup = simulation.data.body(body_name("cup")).xpos.copy()
    if manner == ABANDONED:
        over = pose(cup + CARRY_HEIGHT * UP, rotation(up))
        yield from arm.turn_back(up, over)
        yield from arm.line(shifted(home, 0.001 * UP), arm.APPROACH_SPEED * 1.5)
        yield from arm.release(OPENING, back=CARRY_HEIGHT - position(home)[2])
    else:
        yield from _drop(arm, cup + (BESIDE if manner == INEFFECTIVE else 0.0))
    yield from arm.park()


def _drop(arm: Arm, place: np.ndarray) -> Motion:
    """Carry the bag above `place` (3,) [m], lower it and release it."""
    hand = rotation(arm.tcp)
    yield from arm.line(pose(place + CARRY_HEIGHT * UP, hand))
    yield from arm.line(pose(place + DROP_HEIGHT * UP, hand), 0.25)
    yield from arm.release(OPENING, back=CARRY_HEIGHT - DROP_HEIGHT)
