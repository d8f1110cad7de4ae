"""A sub-task happens when physics says so: no skill is run in this file."""

import numpy as np
import pytest

from teasim.constants import GRIPPER_SQUEEZE, STATE_NAMES
from teasim.world.liquids import CUP_BASE, VESSELS
from teasim.world.station import body_name

LEFT_HAND = STATE_NAMES.index("left_gripper")
ADDED = {"kettle": "add_water", "milk_jug": "add_milk", "sugar_pot": "add_sugar"}


def rest(simulation, steps: int = 1) -> None:
    for _ in range(steps):
        simulation.step(simulation.target)


def turn_knob(simulation, degrees: float) -> None:
    simulation.data.joint("knob").qpos = np.radians(degrees)
    simulation.data.joint("knob").qvel = 0
    rest(simulation)


def teleport(simulation, name: str, place: np.ndarray) -> None:
    """Put a body upright at `place` (3,) [m], at rest."""
    joint = simulation.data.joint(body_name(name))
    joint.qpos[:3], joint.qpos[3:] = place, [1, 0, 0, 0]
    joint.qvel[:] = 0


def in_cup(simulation, *offset: float) -> np.ndarray:
    """A point (3,) [m] at `offset` from the middle of the cup's underside."""
    return simulation.data.body("cup/cup").xpos + np.array(offset)


def test_the_knob_turns_the_oven_on_and_off(simulation):
    turn_knob(simulation, 90)
    assert (simulation.subtasks_done, simulation.oven_on) == (("turn_on_oven",), True)
    turn_knob(simulation, 0)
    assert simulation.subtasks_done == ("turn_on_oven", "turn_off_oven")
    assert not simulation.oven_on
    times = [event.time for event in simulation.events]
    assert 0 < times[0] < times[1] <= simulation.data.time


def test_a_knob_between_on_and_off_stays_what_it_was(simulation):
    turn_knob(simulation, 40)
    assert (simulation.events, simulation.oven_on) == ((), False)
    turn_knob(simulation, 90)
    turn_knob(simulation, 40)
    assert (simulation.subtasks_done, simulation.oven_on) == (("turn_on_oven",), True)


@pytest.mark.parametrize("vessel", VESSELS)
@pytest.mark.parametrize(("share", "happens"), [(0.5, False), (0.7, True)])
def test_a_serving_in_the_cup_counts_as_added(simulation, vessel, share, happens):
    content = VESSELS[vessel].content
    simulation.liquids.cup[content] = share * VESSELS[vessel].filling
    rest(simulation, 2)
    assert simulation.subtasks_done == ((ADDED[vessel],) if happens else ())


def test_a_bag_let_go_in_the_cup_is_added(simulation):
    teleport(simulation, "tea_bag", in_cup(simulation, 0, 0, 0.03))
    rest(simulation, 5)
    assert simulation.subtasks_done == ("add_tea_bag",)
    teleport(simulation, "tea_bag", np.array([0.2, 0.0, 0.02]))
    rest(simulation)
    assert not simulation.recogniser.bag_in_cup


@pytest.mark.parametrize("offset", [(0, 0, 0.15), (0.08, 0, 0.01)])
def test_a_bag_above_or_beside_the_cup_is_not_added(simulation, offset):
    teleport(simulation, "tea_bag", in_cup(simulation, *offset))
    simulation.step(simulation.target)
    assert simulation.events == ()


def test_a_bag_still_held_is_not_added(simulation):
    data = simulation.data
    target = simulation.target.copy()
    target[LEFT_HAND] = 0.02
    for _ in range(10):
        simulation.step(target)
    bag, hand = data.joint("tea_bag/tea_bag"), data.site("left_tcp")
    target[LEFT_HAND] = GRIPPER_SQUEEZE
    # Flat between the fingers: the bag's thin axis along the hand's closing axis.
    turn = hand.xmat.reshape(3, 3)[:, 0]
    yaw = np.arctan2(turn[1], turn[0]) - np.pi / 2
    for _ in range(12):
        bag.qpos = [*(hand.xpos - [0, 0, 0.056]), np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
        bag.qvel = 0
        simulation.step(target)
    # Bring the cup to the bag.
    cup = data.joint("cup/cup")
    cup.qpos = [*(data.body("tea_bag/tea_bag").xpos - [0, 0, 0.02]), 1, 0, 0, 0]
    cup.qvel = 0
    simulation.step(target)
    assert simulation.events == ()
    assert not simulation.recogniser.bag_in_cup


def counted(simulation, water: float) -> None:
    """Let the water in the cup be an event that has been recorded before."""
    simulation.recogniser._watchers["add_water"]._counted = water


def stir(simulation, turns: float, *, depth: float, radius: float = 0.015) -> None:
    """Move the tip of the spoon around in the cup by hand."""
    for angle in np.arange(0, 2 * np.pi * turns, 0.2):
        tip = in_cup(simulation, radius * np.cos(angle), radius * np.sin(angle), depth)
        teleport(simulation, "spoon", tip)
        simulation.data.site("spoon/tip").xpos[:] = tip
        simulation.recogniser.update(simulation.data, simulation.liquids)


@pytest.mark.parametrize("direction", [1, -1])
def test_two_turns_in_the_liquid_are_stirring(simulation, direction):
    simulation.liquids.cup["water"] = 50.0
    counted(simulation, 50.0)
    stir(simulation, 1.8, depth=CUP_BASE + 0.003, radius=direction * 0.015)
    assert simulation.events == ()
    stir(simulation, 2.3, depth=CUP_BASE + 0.003)
    assert simulation.subtasks_done == ("stir",)


@pytest.mark.parametrize(
    ("water", "depth", "radius"),
    [(0.0, CUP_BASE + 0.003, 0.015), (50.0, 0.05, 0.015), (50.0, CUP_BASE + 0.003, 0.06)],
    ids=["empty", "above the liquid", "beside the cup"],
)
def test_turns_elsewhere_are_not(simulation, water, depth, radius):
    simulation.liquids.cup["water"] = water
    counted(simulation, water)
    stir(simulation, 4, depth=depth, radius=radius)
    assert simulation.events == ()
