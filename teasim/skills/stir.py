"""Taking the spoon from its holder, stirring the cup, and putting the spoon back."""

import numpy as np
from mink import SE3

from teasim.errors import SkillError
from teasim.skills.arm import Arm, Motion
from teasim.skills.geometry import UP, pose, rotation, shifted, tool
from teasim.world.simulation import Simulation
from teasim.world.station import body_name

OPENING = 0.024
"""Opening of the gripper around the handle [m]."""
TIP_HEIGHT = 0.016
"""Height of the spoon's tip above the cup's underside while stirring [m]."""
CLEAR_HEIGHT = 0.10
"""Height of the spoon's tip on its way [m]: above the rim and above the holder."""
RADIUS = 0.015
"""Radius of the stirring circle [m]."""
TURNS_PER_SECOND = 1.0
"""Stirring speed; the tempo of a style does not change it."""


def stir(arm: Arm) -> Motion:
    """Stir the cup and put the spoon back.

    Raises:
        SkillError: the spoon does not stand in its holder.
    """
    simulation = arm.simulation
    leaning = _spoon_pose(simulation)
    if rotation(leaning)[2, 2] < np.cos(np.radians(35)):
        raise SkillError("The spoon does not stand in its holder; reset the station.")
    yield from arm.take(arm.easier(_grasp(simulation, leaning)), OPENING)
    held = leaning.inverse() @ arm.tcp  # the hand in the spoon's frame
    standing = _standing(simulation)
    cup = pose(simulation.data.body(body_name("cup")).xpos.copy(), rotation(standing))

    def hand(over: SE3, offset: np.ndarray) -> SE3:
        return shifted(over, offset) @ held

    # Upright before it is drawn: leaning, the bowl would catch on the holder's wall.
    yield from arm.line(hand(standing, 0.002 * UP), arm.APPROACH_SPEED)
    yield from arm.line(hand(standing, CLEAR_HEIGHT * UP))
    yield from arm.line(hand(cup, CLEAR_HEIGHT * UP))
    start = _beside_bag(simulation)
    yield from arm.line(hand(cup, _circle(start) + (CLEAR_HEIGHT - TIP_HEIGHT) * UP))
    yield from arm.line(hand(cup, _circle(start)), 0.25)
    turns = arm.style.stir_turns
    seconds = turns / TURNS_PER_SECOND * arm.style.tempo
    yield from arm.path(
        lambda share: hand(cup, _circle(start + 2 * np.pi * turns * share)), seconds, eased=False
    )
    yield from arm.line(hand(cup, TIP_HEIGHT * UP))
    yield from arm.line(hand(cup, CLEAR_HEIGHT * UP), 0.25)
    yield from arm.line(hand(standing, CLEAR_HEIGHT * UP))
    yield from arm.line(hand(standing, 0.002 * UP), arm.APPROACH_SPEED * 1.5)
    yield from arm.release(OPENING)
    yield from arm.park()


def _beside_bag(simulation: Simulation) -> float:
    """Angle of the stirring circle at which the spoon goes in without standing on the bag [rad]."""
    cup = simulation.data.body(body_name("cup")).xpos
    leaning = (simulation.data.site("tea_bag/grasp").xpos - cup)[:2]
    flat = simulation.data.body(body_name("tea_bag")).xmat.reshape(3, 3)[:2, 1]
    away = -leaning if np.linalg.norm(leaning) > RADIUS / 2 else flat
    return float(np.arctan2(away[1], away[0]))


def _circle(angle: float) -> np.ndarray:
    return np.array([RADIUS * np.cos(angle), RADIUS * np.sin(angle), TIP_HEIGHT])


def _standing(simulation: Simulation) -> SE3:
    """The spoon upright in the middle of its holder."""
    holder = simulation.data.body(body_name("spoon_holder"))
    return pose(holder.xpos.copy(), holder.xmat.reshape(3, 3).copy())


def _spoon_pose(simulation: Simulation) -> SE3:
    body = simulation.data.body(body_name("spoon"))
    return pose(body.xpos.copy(), body.xmat.reshape(3, 3).copy())


def _grasp(simulation: Simulation, home: SE3) -> SE3:
    place = simulation.data.site("spoon/grasp").xpos.copy()
    return pose(place, tool(-rotation(home)[:, 2], rotation(home)[:, 1]))
