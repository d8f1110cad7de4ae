"""The skills that turn the oven on and off: grasp the knob from above and turn it by 90 degrees."""

import numpy as np
from mink import SE3

from teasim.skills.arm import SECOND_THOUGHTS, Arm, Motion
from teasim.skills.geometry import DOWN, UP, about, pose, position, rotation, tool
from teasim.task.mistakes import ABANDONED, INEFFECTIVE, Manner
from teasim.world.simulation import Simulation

OPENING = 0.032
"""Opening of the gripper before and after the grasp [m]."""
GRASP_HEIGHT = 0.025
"""Height of the tool centre point above the hob's top [m]."""
TURN = np.pi / 2
"""Angle between off and on [rad]."""
SHORT_TURN = 0.4
"""Share of the turn of the ineffective manner; it reaches neither on nor off."""


def turn_knob_to(arm: Arm, goal: float, manner: Manner) -> Motion:
    """Turn the knob to `goal` [rad]; not far enough if ineffective, not at all if abandoned."""
    angle, place = _knob(arm.simulation)
    across = np.array([-np.sin(angle), np.cos(angle), 0.0])
    grasp = arm.easier(pose(place + GRASP_HEIGHT * UP, tool(DOWN, across)))
    yield from arm.take(grasp, OPENING)
    turn = (goal - angle) * (SHORT_TURN if manner == INEFFECTIVE else 1.0)

    def turned(share: float) -> SE3:
        return pose(position(grasp), about(UP, turn * share) @ rotation(grasp))

    if manner == ABANDONED:
        yield from arm.wait(SECOND_THOUGHTS)
    else:
        yield from arm.path(turned, max(abs(turn), 0.1) / arm.TURN_SPEED * 1.6)
    yield from arm.release(OPENING)
    yield from arm.park()


def turn_on_oven(arm: Arm, manner: Manner) -> Motion:
    """Turn the oven's knob from off to on."""
    yield from turn_knob_to(arm, TURN, manner)


def turn_off_oven(arm: Arm, manner: Manner) -> Motion:
    """Turn the oven's knob from on to off."""
    yield from turn_knob_to(arm, 0.0, manner)


def _knob(simulation: Simulation) -> tuple[float, np.ndarray]:
    angle = float(simulation.data.joint("knob").qpos[0])
    return angle, np.array(simulation.data.body("knob").xpos)
