"""The monitor sees what it is there to see."""

import numpy as np
import pytest

from teasim.constants import ARM_JOINTS
from teasim.world.monitor import Monitor, roles
from teasim.world.station import FREE_BODIES, nominal_layout, station_model


def test_every_shape_has_a_role():
    named = set(roles(station_model()))
    robot = {f"{side}_{part}" for side in ("right", "left") for part in ("arm", "fingers")}
    assert {*robot, "torso", "table", "hob", "knob", *FREE_BODIES} <= named


def test_a_station_at_rest_has_nothing_to_report(simulation):
    monitor = Monitor(simulation)
    simulation.step(simulation.target)
    assert monitor.forbidden == ()
    assert monitor.joint_speed < 0.01
    assert monitor.tcp_speed < 0.01
    assert monitor.penetration < 1e-4
    assert ("hob", "kettle") in monitor.touches


def test_folded_arms_bump_into_the_torso_and_each_other(simulation):
    monitor = Monitor(simulation)
    for arm, joints in ARM_JOINTS.items():
        for name in joints:
            simulation.data.joint(name).qpos = 0
        assert arm
    simulation.step(simulation.target)
    assert ("left_arm", "right_arm") in monitor.forbidden
    assert monitor.penetration > 0.003


def test_a_hasty_arm_is_noticed(simulation):
    monitor = Monitor(simulation)
    simulation.data.joint("right_joint_1").qvel = np.pi
    simulation.step(simulation.target)
    assert monitor.joint_speed > 0.5
    assert monitor.tcp_speed > 0.5


def test_fingers_may_touch_things_and_arms_may_not(simulation):
    monitor = Monitor(simulation)
    monitor.touches = {("cup", "left_fingers"): 1e-4, ("left_arm", "milk_jug"): 1e-4}
    assert monitor.forbidden == ()
    for pair in (("cup", "left_arm"), ("left_fingers", "right_arm"), ("right_arm", "table")):
        monitor.touches = {pair: 1e-4}
        assert monitor.forbidden == (pair,)


def test_a_reset_is_no_motion(simulation):
    simulation.data.joint("right_joint_1").qpos += 0.5
    simulation.step(simulation.target)
    monitor = Monitor(simulation)
    simulation.reset(nominal_layout())
    assert monitor.tcp_speed == pytest.approx(0, abs=0.01)
