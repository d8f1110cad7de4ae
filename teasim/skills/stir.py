"""Taking the spoon from its holder, stirring the cup, and putting the spoon back."""

import numpy as np
from mink import SE3

from teasim.errors import SkillError
from teasim.skills.arm import Arm, Motion
from teasim.skills.geometry import UP, pose, position, rotation, shifted, tool
from teasim.world.simulation import Simulation
from teasim.world.station import body_name

OPENING = 0.024
"""Opening of the gripper around the handle [m]."""
TIP_HEIGHT = 0.010
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
    home = _spoon_pose(simulation)
    if rotation(home)[2, 2] < np.cos(np.radians(35)):
        raise SkillError("The spoon does not stand in its holder; reset the station.")
    yield from arm.take(arm.easier(_grasp(simulation, home)), OPENING)
    out = shifted(arm.tcp, (CLEAR_HEIGHT - position(home)[2]) * rotation(home)[:, 2])
    yield from arm.line(out)
    held = _spoon_pose(simulation).inverse() @ arm.tcp  # the hand in the spoon's frame
    cup = simulation.data.body(body_name("cup")).xpos.copy()

    def hand(offset: np.ndarray) -> SE3:
        return pose(cup + offset, np.eye(3)) @ _turned_like(home) @ held

    yield from arm.line(hand(CLEAR_HEIGHT * UP))
    yield from arm.line(hand(TIP_HEIGHT * UP), 0.25)
    yield from arm.line(hand(np.array([RADIUS, 0.0, TIP_HEIGHT])))
    turns = arm.style.stir_turns
    seconds = turns / TURNS_PER_SECOND * arm.style.tempo
    yield from arm.path(lambda share: hand(_circle(turns * share)), seconds, eased=False)
    yield from arm.line(hand(TIP_HEIGHT * UP))
    yield from arm.line(hand(CLEAR_HEIGHT * UP), 0.25)
    yield from arm.line(pose(position(home) + _clear(home), rotation(home)) @ held)
    yield from arm.line(shifted(home @ held, 0.001 * UP), arm.APPROACH_SPEED * 1.5)
    yield from arm.release(OPENING)
    yield from arm.park()


def _clear(home: SE3) -> np.ndarray:
    """From the spoon's place along its own axis to above the holder (3,) [m]."""
    return np.asarray((CLEAR_HEIGHT - position(home)[2]) * rotation(home)[:, 2])


def _circle(turns: float) -> np.ndarray:
    angle = 2 * np.pi * turns
    return np.array([RADIUS * np.cos(angle), RADIUS * np.sin(angle), TIP_HEIGHT])


def _turned_like(home: SE3) -> SE3:
    """Upright, with the spoon's flat side facing as it does in the holder."""
    x = rotation(home)[:, 0]
    yaw = np.arctan2(x[1], x[0])
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    return pose(np.zeros(3), turn)


def _spoon_pose(simulation: Simulation) -> SE3:
    body = simulation.data.body(body_name("spoon"))
    return pose(body.xpos.copy(), body.xmat.reshape(3, 3).copy())


def _grasp(simulation: Simulation, home: SE3) -> SE3:
    place = simulation.data.site("spoon/grasp").xpos.copy()
    return pose(place, tool(-rotation(home)[:, 2], rotation(home)[:, 1]))
