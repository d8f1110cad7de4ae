"""The skill that takes the spoon from its holder, stirs the cup, and puts the spoon back."""

import numpy as np
from mink import SE3

from teasim.common.errors import SkillError
from teasim.skills.arm import Arm, Motion
from teasim.skills.geometry import UP, pose, rotation, shifted, tool
from teasim.task.mistakes import ABANDONED, INEFFECTIVE, Manner
from teasim.world.simulation import Simulation
from teasim.world.station import body_name

OPENING = 0.024
"""Opening of the gripper around the handle [m]."""
TIP_HEIGHT = 0.016
"""Height of the spoon's tip above the cup's underside while stirring [m]."""
ABOVE = 0.058
"""The same for the ineffective manner [m]; the liquid in a full cup reaches 0.044 m."""
CLEAR_HEIGHT = 0.10
"""Height of the spoon's tip between holder and cup [m]."""
RADIUS = 0.015
"""Radius of the stirring circle [m]."""
TURNS_PER_SECOND = 1.0
"""Stirring speed; the tempo of a style does not change it."""


def stir(arm: Arm, manner: Manner) -> Motion:
    """Stir the cup and put the spoon back; above the liquid if ineffective, not if abandoned.

    Raises:
        SkillError: the spoon is not upright in its holder.
    """
    simulation = arm.simulation
    leaning = _spoon_pose(simulation)
    if rotation(leaning)[2, 2] < np.cos(np.radians(35)):
        raise SkillError("The spoon does not stand in its holder; reset the station.")
    yield from arm.take(arm.easier(_grasp(simulation, leaning)), OPENING)
    held = leaning.inverse() @ arm.tcp  # the hand in the spoon's frame
    standing = _standing(simulation)
    cup = pose(simulation.data.body(body_name("cup")).xpos.copy(), rotation(standing))
    up = shifted(standing, CLEAR_HEIGHT * UP) @ held
    # The spoon is made upright before it is lifted: tilted, its bowl would catch on the wall.
    yield from arm.line(shifted(standing, 0.002 * UP) @ held, arm.APPROACH_SPEED)
    yield from arm.line(up)
    if manner == ABANDONED:
        yield from arm.turn_back(up, shifted(cup, CLEAR_HEIGHT * UP) @ held)
    else:
        yield from _round(arm, cup, held, ABOVE if manner == INEFFECTIVE else TIP_HEIGHT)
        yield from arm.line(up)
    yield from arm.line(shifted(standing, 0.002 * UP) @ held, arm.APPROACH_SPEED * 1.5)
    yield from arm.release(OPENING)
    yield from arm.park()


def _round(arm: Arm, cup: SE3, held: SE3, height: float) -> Motion:
    """Move to the cup, stir with the spoon's tip at `height` [m], and leave the cup."""
    start = _beside_bag(arm.simulation)
    turns = 2 * np.pi * arm.style.stir_turns

    def hand(angle: float, level: float = height) -> SE3:
        circle = np.array([RADIUS * np.cos(angle), RADIUS * np.sin(angle), level])
        return shifted(cup, circle) @ held

    yield from arm.line(shifted(cup, CLEAR_HEIGHT * UP) @ held)
    yield from arm.line(hand(start, CLEAR_HEIGHT))
    yield from arm.line(hand(start), 0.25)
    seconds = arm.style.stir_turns / TURNS_PER_SECOND * arm.style.tempo
    yield from arm.path(lambda share: hand(start + turns * share), seconds, eased=False)
    yield from arm.line(shifted(cup, height * UP) @ held)
    yield from arm.line(shifted(cup, CLEAR_HEIGHT * UP) @ held, 0.25)


def _beside_bag(simulation: Simulation) -> float:
    """Return the angle on the circle [rad] at which the spoon enters beside the tea bag."""
    cup = simulation.data.body(body_name("cup")).xpos
    leaning = (simulation.data.site("tea_bag/grasp").xpos - cup)[:2]
    flat = simulation.data.body(body_name("tea_bag")).xmat.reshape(3, 3)[:2, 1]
    away = -leaning if np.linalg.norm(leaning) > RADIUS / 2 else flat
    return float(np.arctan2(away[1], away[0]))


def _standing(simulation: Simulation) -> SE3:
    """Return the pose of the spoon upright in the middle of its holder."""
    holder = simulation.data.body(body_name("spoon_holder"))
    return pose(holder.xpos.copy(), holder.xmat.reshape(3, 3).copy())


def _spoon_pose(simulation: Simulation) -> SE3:
    body = simulation.data.body(body_name("spoon"))
    return pose(body.xpos.copy(), body.xmat.reshape(3, 3).copy())


def _grasp(simulation: Simulation, home: SE3) -> SE3:
    place = simulation.data.site("spoon/grasp").xpos.copy()
    return pose(place, tool(-rotation(home)[:, 2], rotation(home)[:, 1]))
