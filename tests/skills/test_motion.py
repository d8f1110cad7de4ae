"""Geometry, inverse kinematics, and how an arm paces its motions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.common.errors import SkillError
from teasim.constants import ARMS, CONTROL_TIMESTEP
from teasim.skills.arm import SPEED_MARGIN, Arm
from teasim.skills.geometry import (
    DOWN,
    EASE_PEAK,
    UP,
    about,
    between,
    ease,
    flipped,
    pose,
    position,
    rotation,
    shifted,
    tool,
    turn_angle,
)
from teasim.skills.ik import ANGLE_TOLERANCE, POSITION_TOLERANCE, kinematics
from teasim.skills.pour import KETTLE, MILK_JUG, SUGAR_POT, spout_offset
from teasim.skills.style import Style
from teasim.world.bodies.yumi import JOINT_SPEEDS, READY, SOFT_LIMITS
from teasim.world.simulation import Simulation
from teasim.world.station import nominal_layout

NUMBERS = st.floats(-1, 1)
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS).map(np.array)
AXES = VECTORS.filter(lambda v: np.linalg.norm(v) > 0.1).map(lambda v: v / np.linalg.norm(v))
ANGLES = st.floats(-3, 3)
SHARES = st.floats(0, 1)
POSES = st.builds(lambda at, axis, angle: pose(at, about(axis, angle)), VECTORS, AXES, ANGLES)


@given(POSES, POSES)
def test_a_straight_way_goes_from_start_to_end(start, end):
    for share, there in ((0, start), (1, end)):
        here = between(start, end, share)
        assert position(here) == pytest.approx(position(there), abs=1e-6)
        assert rotation(here) == pytest.approx(rotation(there), abs=1e-5)


@given(AXES, ANGLES, SHARES)
def test_half_way_has_half_of_the_turn(axis, angle, share):
    start, end = pose(np.zeros(3), np.eye(3)), pose(axis, about(axis, angle))
    there = between(start, end, share)
    assert turn_angle(start, there) == pytest.approx(share * abs(angle), abs=1e-5)
    assert position(there) == pytest.approx(share * axis, abs=1e-9)


@given(AXES, AXES)
def test_a_tool_points_forward_and_closes_across(forward, closing):
    if abs(forward @ closing) > 0.99:
        return
    axes = tool(forward, closing)
    assert axes.T @ axes == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1)
    assert axes[:, 2] == pytest.approx(forward)
    assert axes[:, 0] @ closing > 0


@given(POSES)
def test_exchanging_the_fingers_twice_changes_nothing(grasp):
    other = flipped(grasp)
    assert rotation(other)[:, 2] == pytest.approx(rotation(grasp)[:, 2], abs=1e-9)
    assert rotation(other)[:, 0] == pytest.approx(-rotation(grasp)[:, 0], abs=1e-9)
    assert rotation(flipped(other)) == pytest.approx(rotation(grasp), abs=1e-9)


def test_easing_starts_and_ends_at_rest_with_the_stated_peak():
    shares = np.linspace(0, 1, 1001)
    speed = np.gradient(ease(shares), shares)
    assert (ease(shares)[0], ease(shares)[-1]) == (0, 1)
    assert (np.diff(ease(shares)) >= 0).all()
    assert speed[[0, -1]] == pytest.approx([0, 0], abs=1e-3)
    assert speed.max() == pytest.approx(EASE_PEAK, rel=1e-3)


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("seed", range(5))
def test_inverse_kinematics_inverts_the_forward_kinematics(arm, seed):
    solver = kinematics(arm)
    solver.prefer(READY[arm])
    random = np.random.default_rng(seed)
    goal = solver.pose(READY[arm] + random.uniform(-0.4, 0.4, 7))
    joints = solver.solve(goal, READY[arm])
    reached = solver.pose(joints)
    assert np.linalg.norm(position(reached) - position(goal)) < POSITION_TOLERANCE
    assert turn_angle(reached, goal) < 1.5 * ANGLE_TOLERANCE
    assert ((SOFT_LIMITS[:, 0] <= joints) & (joints <= SOFT_LIMITS[:, 1])).all()
    assert solver.solve(goal, READY[arm]).tobytes() == joints.tobytes()


@pytest.mark.parametrize("arm", ARMS)
def test_what_is_out_of_reach_is_said_to_be(arm):
    goal = pose(np.array([2.0, 0.0, 0.5]), tool(DOWN, np.array([1.0, 0.0, 0.0])))
    with pytest.raises(SkillError) as error:
        kinematics(arm).solve(goal, READY[arm])
    assert str(error.value) == (
        f"The {arm} arm cannot reach (2.000, 0.000, 0.500) m in the wanted orientation; "
        "move the object nearer to its nominal place."
    )


@pytest.fixture
def arm():
    simulation = Simulation()
    simulation.reset(nominal_layout())
    return Arm("right", simulation, Style(tempo=1.0))


def follow(arm: Arm, motion) -> tuple[np.ndarray, np.ndarray]:
    """Take the targets without physics; joint angles (n, 7) and tool places (n, 3)."""
    joints, places = [arm.joints.copy()], [position(arm.tcp)]
    for target in motion:
        arm.simulation.target = target
        joints.append(arm.joints.copy())
        places.append(position(arm.tcp))
    return np.array(joints), np.array(places)


def test_a_line_is_straight_and_keeps_its_speed(arm):
    start = position(arm.tcp)
    offset = np.array([0.05, 0.08, -0.05])
    joints, places = follow(arm, arm.line(shifted(arm.tcp, offset), 0.2))
    along = (places - start) @ offset / np.linalg.norm(offset) ** 2
    assert np.linalg.norm(places - start - np.outer(along, offset), axis=1).max() < 1e-3
    assert places[-1] == pytest.approx(start + offset, abs=1e-3)
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / CONTROL_TIMESTEP
    assert speeds.max() == pytest.approx(0.2, rel=0.1)
    assert speeds[[0, -1]].max() < 0.05
    assert np.isfinite(joints).all()


def test_a_path_is_slowed_down_until_the_joints_can_follow(arm):
    start = arm.tcp
    curve = lambda share: pose(position(start), rotation(start) @ about(UP, 2 * share))  # noqa: E731
    joints, _ = follow(arm, arm.path(curve, 0.1))
    speeds = np.diff(joints, axis=0) / CONTROL_TIMESTEP / JOINT_SPEEDS
    assert 0.4 * SPEED_MARGIN < np.abs(speeds).max() <= SPEED_MARGIN + 1e-9
    # Between two targets the controller's cubic is faster than at either, two thirds through.
    inside = (4 * speeds[1:] - speeds[:-1]) / 3
    assert np.abs(inside).max() <= SPEED_MARGIN + 1e-9


def test_twice_the_tempo_takes_half_the_time(arm):
    goal = shifted(arm.tcp, np.array([0.0, 0.0, 0.1]))
    slow = sum(1 for _ in arm.line(goal, 0.1))
    fast = sum(1 for _ in Arm("right", arm.simulation, Style(tempo=2.0)).line(goal, 0.1))
    assert fast == pytest.approx(slow / 2, abs=1)


def test_parking_leads_to_ready_from_anywhere(arm):
    arm.simulation.target[:7] += 0.3
    joints, _ = follow(arm, arm.park())
    assert joints[-1] == pytest.approx(READY["right"])


@pytest.mark.parametrize("grip", [KETTLE, MILK_JUG, SUGAR_POT], ids=lambda grip: grip.vessel)
def test_the_spout_moves_in_over_the_cup_as_the_vessel_tilts(grip):
    offsets = [spout_offset(grip, np.radians(degrees)) for degrees in range(0, 101)]
    assert offsets[0] > 0.02
    assert offsets[-1] == 0
    assert (np.diff(offsets) <= 1e-9).all()


def test_the_grips_know_the_spouts_of_the_models():
    model = Simulation().model
    for grip in (KETTLE, MILK_JUG, SUGAR_POT):
        assert model.site(f"{grip.vessel}/spout").pos == pytest.approx(grip.spout)
        assert model.geom(f"{grip.vessel}/body").size[0] == grip.belly
