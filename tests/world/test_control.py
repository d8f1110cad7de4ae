"""Targets at 10 Hz become a smooth motion through every target."""

from itertools import pairwise

import mujoco
import numpy as np
import pytest

from teasim.constants import ARMS, CONTROL_TIMESTEP, GRIPPER_OPEN, GRIPPER_SQUEEZE, STATE_NAMES
from teasim.world.bodies.yumi import FINGER_SPEED, READY
from teasim.world.control import Controller
from teasim.world.monitor import PENETRATION_LIMIT
from teasim.world.station import station_model

UPDATES = 5
CENTRES = (np.arange(UPDATES) + 0.5) / UPDATES  # when within a step the updates aim
ARM_MOTORS = slice(0, 14)


@pytest.fixture(scope="module")
def curves():
    """Cubics (step, 4, joint), highest power first, that the motors are sent through targets."""
    model = station_model()
    model.actuator_biasprm[:, 2] = 0.0  # no damping, so the commands are the positions alone
    data = mujoco.MjData(model)
    controller = Controller(model)
    controller.reset(data)
    motors = [model.actuator(name).id for name in STATE_NAMES[:14]]
    targets = np.zeros((8, 16))
    targets[1:, ARM_MOTORS] = np.random.default_rng(0).uniform(-0.3, 0.3, (7, 14))
    fits = []
    for target in targets[1:]:
        segment = controller.commands(target, data)
        sent = []
        for update in range(UPDATES):
            segment.apply(update, data)
            sent.append(data.ctrl[motors].copy())
        fits.append(np.polyfit(CENTRES, np.array(sent), 3))
    return targets[:, ARM_MOTORS], np.array(fits)


def value(curve: np.ndarray, share: float) -> np.ndarray:
    return np.array([share**3, share**2, share, 1.0]) @ curve


def slope(curve: np.ndarray, share: float) -> np.ndarray:
    return np.array([3 * share**2, 2 * share, 1.0, 0.0]) @ curve


def test_the_commands_pass_through_every_target(curves):
    targets, cubics = curves
    for (start, end), curve in zip(pairwise(targets), cubics, strict=True):
        assert value(curve, 0) == pytest.approx(start, abs=1e-9)
        assert value(curve, 1) == pytest.approx(end, abs=1e-9)


def test_the_velocity_is_continuous_and_is_the_last_steps_mean(curves):
    targets, cubics = curves
    assert slope(cubics[0], 0) == pytest.approx(np.zeros(14), abs=1e-9)  # starts from rest
    for k, (before, after) in enumerate(pairwise(cubics)):
        assert slope(before, 1) == pytest.approx(slope(after, 0), abs=1e-9)
        assert slope(before, 1) == pytest.approx(targets[k + 1] - targets[k], abs=1e-9)


def test_the_measured_joints_follow_the_targets(simulation):
    start = simulation.target.copy()
    swing = np.zeros(16)
    swing[ARM_MOTORS] = 0.1
    worst = 0.0
    for k in range(1, 31):
        target = start + swing * (1 - np.cos(2 * np.pi * k / 30)) / 2
        simulation.step(target)
        worst = max(worst, np.abs(simulation.joint_state() - target)[ARM_MOTORS].max())
    assert worst < 0.006


def test_commands_stay_within_the_joints_ranges(simulation):
    simulation.step(np.where(np.arange(16) < 14, 100.0, simulation.target))
    for name in STATE_NAMES[:14]:
        low, high = simulation.model.joint(name).range
        assert low <= simulation.data.actuator(name).ctrl[0] <= high


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize(("start", "end"), [(0.0, GRIPPER_OPEN), (GRIPPER_OPEN, 0.0)])
def test_fingers_keep_their_speed_limit(simulation, arm, start, end):
    hand = STATE_NAMES.index(f"{arm}_gripper")
    drive(simulation, hand, start, seconds=1.5)
    speeds, openings = [], []
    finger = simulation.data.joint(f"{arm}_finger_a")
    simulation.observers.append(lambda: speeds.append(abs(finger.qvel[0])))
    for _ in range(15):
        drive(simulation, hand, end, seconds=CONTROL_TIMESTEP)
        openings.append(float(simulation.joint_state()[hand]))
    assert max(speeds) < 1.1 * FINGER_SPEED
    assert openings[7] != pytest.approx(end, abs=5e-3)  # 25 mm at 25 mm/s take a second
    assert openings[-1] == pytest.approx(end, abs=1e-3)


def test_a_squeeze_of_nothing_presses_with_20_newtons_a_finger_and_closes(simulation):
    hand = STATE_NAMES.index("left_gripper")
    drive(simulation, hand, GRIPPER_SQUEEZE, seconds=2.0)
    assert simulation.data.actuator("left_gripper").force[0] == pytest.approx(
        -40, abs=3
    )  # the pads give way a little
    assert simulation.joint_state()[hand] == pytest.approx(0, abs=PENETRATION_LIMIT)


def test_a_squeeze_is_let_go_at_once(simulation):
    hand = STATE_NAMES.index("left_gripper")
    drive(simulation, hand, GRIPPER_SQUEEZE, seconds=2.0)
    drive(simulation, hand, 0.02, seconds=0.5)
    assert simulation.joint_state()[hand] > 0.015


def test_a_reset_holds_what_is(simulation):
    assert simulation.target[:14] == pytest.approx(np.concatenate([READY[arm] for arm in ARMS]))
    state = simulation.joint_state()
    simulation.step(simulation.target)
    assert simulation.joint_state() == pytest.approx(state, abs=1e-4)


def drive(simulation, column: int, value: float, seconds: float) -> None:
    target = simulation.target.copy()
    target[column] = value
    for _ in range(round(seconds / CONTROL_TIMESTEP)):
        simulation.step(target)
