"""Lifting the tea bag by its tag and letting it drop into the cup."""

import numpy as np

from teasim.errors import SkillError
from teasim.skills.arm import Arm, Motion
from teasim.skills.geometry import DOWN, UP, pose, position, rotation, shifted, tool
from teasim.world.station import body_name

OPENING = 0.024
"""Opening of the gripper around the tag [m]."""
CARRY_HEIGHT = 0.21
"""Height of the hand on its way to the cup [m]: the bag passes above the spoon."""
DROP_HEIGHT = 0.095
"""Height of the hand when it lets go over the cup's underside [m]."""


def add_tea_bag(arm: Arm) -> Motion:
    """Put the tea bag into the cup.

    Raises:
        SkillError: the bag is in the cup already, or lies where the gripper cannot take its tag.
    """
    simulation = arm.simulation
    if simulation.recogniser.bag_in_cup:
        raise SkillError("The tea bag is in the cup already; choose another sub-task.")
    bag = simulation.data.body(body_name("tea_bag")).xmat.reshape(3, 3).copy()
    if bag[2, 2] < np.cos(np.radians(25)):
        raise SkillError("The tea bag does not stand in its holder; reset the station.")
    tag = simulation.data.site("tea_bag/grasp").xpos.copy()
    yield from arm.take(arm.easier(pose(tag, tool(DOWN, bag[:, 1]))), OPENING)
    up = arm.tcp
    yield from arm.line(shifted(up, (CARRY_HEIGHT - position(up)[2]) * UP))
    cup = simulation.data.body(body_name("cup")).xpos.copy()
    yield from arm.line(pose(cup + CARRY_HEIGHT * UP, rotation(up)))
    yield from arm.line(pose(cup + DROP_HEIGHT * UP, rotation(up)), 0.25)
    yield from arm.release(OPENING, back=CARRY_HEIGHT - DROP_HEIGHT)
    yield from arm.park()
