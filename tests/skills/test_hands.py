"""A person's hands: their kinematics, and which of the two does what."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.common.errors import SkillError
from teasim.constants import ARMS
from teasim.rollout import run_subtask
from teasim.skills.geometry import DOWN, pose, position, rotation, tool, turn_angle
from teasim.skills.ik import kinematics
from teasim.skills.style import Style
from teasim.task.subtasks import ROWS
from teasim.world.bodies.embodiments import EMBODIMENTS, PERSON
from teasim.world.bodies.person import HAND_RANGE, HANDS_READY
from teasim.world.monitor import Monitor
from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout

HANDS = st.tuples(*(st.floats(low, high) for low, high in HAND_RANGE)).map(np.array)
Y = np.array([0.0, 1.0, 0.0])


@pytest.fixture
def person():
    simulation = Simulation("person")
    simulation.reset(nominal_layout())
    return simulation


@pytest.mark.parametrize("arm", ARMS)
@given(hand=HANDS)
def test_place_and_turns_are_found_again(arm, hand):
    solver = kinematics(arm, "person")
    assert solver.solve(solver.pose(hand), hand) == pytest.approx(hand, abs=1e-6)


@pytest.mark.parametrize("arm", ARMS)
def test_the_plan_and_the_physics_agree_where_a_hand_is(person, arm):
    person.step(person.target)
    site = person.data.site(f"{arm}_tcp")
    planned = kinematics(arm, "person").pose(PERSON.ready[arm])
    assert site.xpos == pytest.approx(position(planned), abs=1e-3)
    measured = pose(site.xpos, site.xmat.reshape(3, 3))
    assert turn_angle(measured, planned) < 1e-2


@pytest.mark.parametrize("arm", ARMS)
def test_both_hands_hold_a_handle_with_the_index_finger_on_top(arm):
    solver = kinematics(arm, "person")
    forward = np.array([np.cos(np.pi / 6), 0.0, -np.sin(np.pi / 6)])
    handle = pose(np.array([0.4, 0.0, 0.1]), tool(forward, -Y))
    joints = solver.solve(handle, HANDS_READY[arm])
    index = -rotation(solver.pose(joints))[:, 1]
    assert index[2] > 0.8
    assert np.abs(joints - HANDS_READY[arm])[3:].max() < np.pi / 2  # no twisted wrist


@pytest.mark.parametrize("arm", ARMS)
def test_what_is_beyond_the_table_is_out_of_reach(arm):
    goal = pose(np.array([2.0, 0.0, 0.5]), tool(DOWN, Y))
    with pytest.raises(SkillError) as error:
        kinematics(arm, "person").solve(goal, HANDS_READY[arm])
    assert str(error.value) == (
        f"The {arm} hand cannot reach (2.000, 0.000, 0.500) m in the wanted orientation; "
        "move the object nearer to its nominal place."
    )


@pytest.mark.parametrize("hand", ARMS)
@pytest.mark.parametrize("subtask", [row.name for row in ROWS if row.either_hand])
def test_people_use_the_hand_they_prefer(person, subtask, hand):
    if subtask == "stir":
        person.liquids.cup.update(water=100.0, milk=50.0)
        person.step(person.target)
    monitor = Monitor(person)
    run_subtask(person, subtask, Style(hand=hand))
    assert person.subtasks_done[-1] == subtask
    thing = {"stir": "spoon", "add_tea_bag": "tea_bag"}[subtask]
    held_by = {pair[0] for pair in monitor.touches if pair[1] == thing} & set(
        f"{arm}_fingers" for arm in ARMS
    )
    assert held_by == {f"{hand}_fingers"}
    assert monitor.forbidden == ()


def test_yumi_takes_the_arm_that_can_reach():
    simulation = Simulation()
    simulation.reset(nominal_layout())
    run_subtask(simulation, "add_tea_bag", Style(hand="right"))
    assert simulation.subtasks_done == ("add_tea_bag",)


@pytest.mark.parametrize("embodiment", EMBODIMENTS)
def test_hesitating_and_taking_again_take_time_and_change_nothing_else(embodiment):
    simulation = Simulation(embodiment)
    steps = {}
    for style in (Style(), Style(hesitation=0.8), Style(regrasp=True)):
        simulation.reset(nominal_layout())
        steps[style] = run_subtask(simulation, "turn_on_oven", style)
        assert simulation.subtasks_done == ("turn_on_oven",)
    straight, hesitant, again = steps.values()
    assert hesitant == straight + 8
    assert again > straight + 5
