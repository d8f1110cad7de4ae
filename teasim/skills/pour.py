"""Pouring from kettle, milk jug and sugar pot into the cup.

The vessel is held by its upright handle, carried beside the cup, and turned about the horizontal
axis across its spout. The spout has to start beside the cup and move in as the vessel tilts, or the
vessel's belly hits the near rim.
"""

from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from mink import SE3

from teasim.common.errors import SkillError
from teasim.constants import CONTROL_TIMESTEP
from teasim.skills.arm import Arm, Curve, Motion
from teasim.skills.geometry import DOWN, UP, about, between, pose, rotation, shifted, tool
from teasim.task.mistakes import ABANDONED, INEFFECTIVE, Manner
from teasim.task.subtasks import find_subtask
from teasim.world.liquids import RIM_HEIGHT
from teasim.world.simulation import Simulation
from teasim.world.station import NOMINAL, body_name

PITCH = np.radians(30)
"""Downward pitch of the gripper at the handle [rad]: less meets the table, more the vessel."""
FULL_TILT = np.radians(100)
"""Tilt at which a vessel runs empty [rad]."""
CLEARANCE = 0.006
"""Gap between the vessel's belly and the rim of the cup [m]."""
CUP_OUTER = 0.040
"""Outer radius of the cup [m]."""
SPOUT_HEIGHT = 0.025
"""Height of the spout above the rim while pouring [m]; as much again before the tilt."""
DESCENT = 0.06
"""The hand comes down this far before it goes in to the handle [m]."""
LONGEST_HOLD = 4.0
"""A vessel is held over the cup for at most this time [s]."""


@dataclass(frozen=True)
class Aim:
    """Where a vessel is poured and how far it is tilted."""

    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """From the cup's axis to where the stream goes down [m]."""
    share: float = 1.0
    """Share of the full tilt that is reached."""
    hold: float = 0.0
    """Shortest time the vessel is held tilted [s]."""


WELL_AIMED = (Aim(),)
"""Into the cup, until the vessel is empty."""
BESIDE = tuple(
    Aim((x, y, 0.0)) for x, y in ((-0.085, 0), (-0.06, 0.06), (-0.06, -0.06), (0.085, 0))
)
"""Beside the cup, on a side that the arm can reach, best first."""
TOO_LITTLE = (Aim(share=0.25, hold=2.0),)
"""Over the cup, at a tilt at which the content still stands below the vessel's lip."""


@dataclass(frozen=True)
class Grip:
    """How a vessel is grasped, and where its spout is."""

    subtask: str
    """The sub-task that pours from the vessel."""
    vessel: str
    """Name of the vessel."""
    opening: float
    """Opening of the gripper around the handle [m]: wider and the inner finger meets the belly."""
    belly: float
    """Outer radius of the vessel [m]."""
    spout: tuple[float, float, float]
    """Tip of the spout in the vessel's frame [m]."""
    closing: float = 1.0
    """1 when the hand's closing axis points to the spout, -1 when it points to the handle."""


KETTLE = Grip("add_water", "kettle", 0.030, 0.042, (0.062, 0.0, 0.072), -1.0)
MILK_JUG = Grip("add_milk", "milk_jug", 0.022, 0.026, (0.036, 0.0, 0.062))
SUGAR_POT = Grip("add_sugar", "sugar_pot", 0.022, 0.026, (0.034, 0.0, 0.052))


def pour(arm: Arm, grip: Grip, manner: Manner) -> Motion:
    """Pour the vessel into the cup until it is empty and put it back where it stood.

    An ineffective pour misses the cup or tilts the vessel too little; an abandoned one puts the
    vessel back half-way.

    Raises:
        SkillError: the vessel does not stand upright.
    """
    simulation = arm.simulation
    home = _vessel_pose(simulation, grip)
    if rotation(home)[2, 2] < np.cos(np.radians(15)):
        raise SkillError(f"The {grip.vessel} does not stand upright; reset the station.")
    grasp = _grasp(simulation, grip, home)
    aims = _poor_aims(grip) if manner == INEFFECTIVE else WELL_AIMED
    aim = aims[arm.choose_way([rehearsal(arm, grip, home, grasp, aim) for aim in aims])]
    # From above: the straight way in joint space would sweep the hand through the vessel.
    yield from arm.reach(shifted(arm.before(grasp), DESCENT * UP), grip.opening)
    yield from arm.line(arm.before(grasp))
    yield from arm.enter(grasp)
    yield from arm.line(shifted(arm.tcp, arm.style.lift * UP), arm.APPROACH_SPEED * 1.5)
    held = _vessel_pose(simulation, grip).inverse() @ arm.tcp  # the hand in the vessel's frame
    tilted = _over_cup(simulation, grip, held, aim)
    above = home @ held
    lifted = shifted(above, arm.style.lift * UP)
    if manner == ABANDONED:
        yield from arm.turn_back(lifted, tilted(0.0))
    else:
        yield from _tip(arm, grip, tilted, aim)
        yield from arm.line(lifted)
    yield from arm.line(shifted(above, 0.001 * UP), arm.APPROACH_SPEED * 1.5)
    yield from arm.release(grip.opening)
    yield from arm.park()


def _poor_aims(grip: Grip) -> tuple[Aim, ...]:
    """Return how an ineffective pour may be aimed, best first."""
    return BESIDE if find_subtask(grip.subtask).misses else TOO_LITTLE


def _tip(arm: Arm, grip: Grip, tilted: Curve, aim: Aim) -> Motion:
    """Move to the cup, tilt, wait until nothing flows any more, and turn upright again."""
    yield from arm.line(tilted(0.0))
    seconds = FULL_TILT / arm.TURN_SPEED * 1.6
    yield from arm.path(tilted, seconds)
    yield from arm.wait(aim.hold)
    yield from _until_empty(arm, grip, aim)
    yield from arm.path(lambda share: tilted(1 - share), seconds)


def rehearsal(arm: Arm, grip: Grip, home: SE3, grasp: SE3, aim: Aim) -> list[Curve]:
    """Return the planned path of the hand from the approach to the full tilt."""
    before = arm.before(grasp)
    lifted = shifted(grasp, arm.style.lift * UP)
    tilted = _over_cup(arm.simulation, grip, home.inverse() @ grasp, aim)
    stops = [shifted(before, DESCENT * UP), before, grasp, lifted, tilted(0.0)]
    return [*(partial(between, *pair) for pair in pairwise(stops)), tilted]


def add_water(arm: Arm, manner: Manner) -> Motion:
    """Pour the kettle into the cup."""
    yield from pour(arm, KETTLE, manner)


def add_milk(arm: Arm, manner: Manner) -> Motion:
    """Pour the milk jug into the cup."""
    yield from pour(arm, MILK_JUG, manner)


def add_sugar(arm: Arm, manner: Manner) -> Motion:
    """Tip the sugar pot over the cup."""
    yield from pour(arm, SUGAR_POT, manner)


def _vessel_pose(simulation: Simulation, grip: Grip) -> SE3:
    body = simulation.data.body(body_name(grip.vessel))
    return pose(body.xpos.copy(), body.xmat.reshape(3, 3).copy())


def _grasp(simulation: Simulation, grip: Grip, home: SE3) -> SE3:
    handle = simulation.data.site(f"{grip.vessel}/grasp").xpos.copy()
    spout = rotation(home)[:, 0]
    sideways = np.cross(UP, spout)
    away = sideways if sideways[0] > 0 else -sideways  # away from the robot
    return pose(handle, tool(np.cos(PITCH) * away + np.sin(PITCH) * DOWN, grip.closing * spout))


def _over_cup(simulation: Simulation, grip: Grip, held: SE3, aim: Aim) -> Curve:
    """Return the pose of the hand by the share of the aim's tilt, the spout kept over the cup."""
    cup = simulation.data.body(body_name("cup")).xpos + np.array(aim.offset)
    yaw = NOMINAL[grip.vessel].yaw
    towards = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    upright = about(UP, yaw)
    spout = np.array(grip.spout)

    def hand(share: float) -> SE3:
        tilt = FULL_TILT * aim.share * share
        turned = about(np.cross(UP, towards), tilt) @ upright
        fade = max(1 - tilt / np.radians(40), 0.0)
        tip = cup - spout_offset(grip, tilt) * towards
        tip = tip + (RIM_HEIGHT + SPOUT_HEIGHT * (1 + fade)) * UP
        return pose(tip - turned @ spout, turned) @ held

    return hand


def spout_offset(grip: Grip, tilt: float) -> float:
    """Return the spout's distance from the cup's axis that keeps the belly off the rim [m]."""
    overhang = grip.spout[0] - grip.belly
    if tilt >= np.radians(80):
        return 0.0
    drop = SPOUT_HEIGHT - CLEARANCE + overhang * np.sin(tilt)
    reach = CUP_OUTER + CLEARANCE - overhang * np.cos(tilt) - drop * np.tan(tilt)
    return float(max(reach, 0.0))


def _until_empty(arm: Arm, grip: Grip, aim: Aim) -> Motion:
    """Hold the vessel until its level, not a clock, says that it is empty."""
    liquids = arm.simulation.liquids
    if aim.share < 1:
        return  # it stays full
    for _ in range(round(LONGEST_HOLD / CONTROL_TIMESTEP)):
        yield from arm.wait(CONTROL_TIMESTEP)
        if liquids.amounts[grip.vessel] < 0.5:
            return
