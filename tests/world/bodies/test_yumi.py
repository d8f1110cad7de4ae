"""The robot is the one in ABB's tables, twice, mirror-wise."""

import mujoco
import numpy as np
import pytest

from teasim.constants import ARM_JOINTS, ARMS, GRIPPER_OPEN
from teasim.world.bodies.yumi import JOINT_SPEEDS, READY, SOFT_LIMITS, planning_model
from teasim.world.station import station_model

MODEL = station_model()
MIRROR = np.diag([1.0, -1.0, 1.0])

# ABB product specification 3HAC052982: axis -> range [deg], speed [deg/s].
ABB = {
    1: (-168.5, 168.5, 180),
    2: (-143.5, 43.5, 180),
    7: (-168.5, 168.5, 180),
    3: (-123.5, 80.0, 180),
    4: (-290.0, 290.0, 400),
    5: (-88.0, 138.0, 400),
    6: (-229.0, 229.0, 400),
}

# Poses of the right arm in ABB's axis order 1 to 6, then 7 [deg] (yumipy), and where the public
# description puts the flange [m] and the direction of the tool.
POSES = {
    "home": ((0, -130, 30, 0, 40, 0, -135), (-0.010, -0.183, 0.197), (0.87, 0.23, -0.44)),
    "ready": (
        (51.16, -99.4, 21.57, -107.19, 84.11, 94.61, -36),
        (0.377, -0.430, 0.306),
        (0.06, 0.0, -1.0),
    ),
    "inwards": ((75, -90, 0, -30, 90, -10, -45), (0.471, -0.308, 0.252), (0, 1, 0)),
    "forwards": (
        (36.42, -117.3, 35.59, 50.42, 46.19, 66.02, -100.28),
        (0.190, -0.254, 0.178),
        (1, 0, 0),
    ),
}


def flange(arm: str, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position (3,) [m] and orientation (3, 3) of an arm's flange at joint angles (7,) [rad]."""
    data = mujoco.MjData(MODEL)
    for name, angle in zip(ARM_JOINTS[arm], joints, strict=True):
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(MODEL, data)
    body = data.body(f"{arm}_gripper")
    return body.xpos.copy(), body.xmat.reshape(3, 3).copy()


def mirrored(joints: np.ndarray) -> np.ndarray:
    """Joint angles (7,) of the left arm that mirror those of the right."""
    return joints * np.array([-1, 1, -1, 1, -1, 1, -1])


def moving_bodies() -> list[str]:
    return [MODEL.body(b).name for b in range(1, MODEL.nbody) if MODEL.body_weldid[b] == b]


@pytest.mark.parametrize("name", moving_bodies())
def test_masses_and_inertias_are_those_of_solid_things(name):
    body = MODEL.body(name)
    inertia = np.sort(body.inertia)
    assert body.mass[0] > 0
    assert inertia[0] > 0
    assert inertia[2] <= inertia[0] + inertia[1] + 1e-12


@pytest.mark.parametrize("arm", ARMS)
def test_an_arm_and_its_gripper_weigh_what_they_should(arm):
    links = sum(MODEL.body(f"{arm}_link_{n}").mass[0] for n in range(1, 8))
    hand = sum(MODEL.body(f"{arm}_{part}").mass[0] for part in ("gripper", "finger_a", "finger_b"))
    assert links == pytest.approx((38 - 24.18) / 2, abs=0.02)
    assert hand == pytest.approx(0.215, abs=1e-6)


@pytest.mark.parametrize("arm", ARMS)
def test_joint_ranges_and_speeds_are_abbs(arm):
    for name, limits, speed in zip(ARM_JOINTS[arm], SOFT_LIMITS, JOINT_SPEEDS, strict=True):
        low, high, fastest = ABB[int(name[-1])]
        joint, motor = MODEL.joint(name), MODEL.actuator(name)
        assert np.degrees(joint.range) == pytest.approx([low, high], abs=1e-3)
        assert motor.ctrlrange == pytest.approx(joint.range)
        assert np.degrees(speed) == pytest.approx(fastest)
        assert joint.range[0] < limits[0] < limits[1] < joint.range[1]


@pytest.mark.parametrize("arm", ARMS)
def test_plans_are_made_within_the_soft_limits(arm):
    model = planning_model(arm)
    ranges = [model.joint(name).range for name in ARM_JOINTS[arm]]
    assert np.array(ranges) == pytest.approx(SOFT_LIMITS)
    assert ((SOFT_LIMITS[:, 0] < READY[arm]) & (READY[arm] < SOFT_LIMITS[:, 1])).all()


@pytest.mark.parametrize("name", POSES)
def test_forward_kinematics_agree_with_the_public_description(name):
    angles, place, tool = POSES[name]
    joints = np.radians(np.array(angles)[[0, 1, 6, 2, 3, 4, 5]])
    position, orientation = flange("right", joints)
    assert position == pytest.approx(place, abs=0.002)
    assert orientation[:, 2] @ np.array(tool) > np.cos(np.radians(5))  # the tables round


@pytest.mark.parametrize(("arm", "side"), [("right", -1), ("left", 1)])
def test_ready_is_in_front_of_the_body_with_the_hands_down(arm, side):
    position, orientation = flange(arm, READY[arm])
    assert position == pytest.approx([0.377, side * 0.43, 0.306], abs=0.002)
    assert orientation[2, 2] < -0.99


@pytest.mark.parametrize("seed", range(5))
def test_the_arms_mirror_each_other(seed):
    low, high = SOFT_LIMITS.T
    joints = np.random.default_rng(seed).uniform(low, high)
    right, left = flange("right", joints), flange("left", mirrored(joints))
    assert left[0] == pytest.approx(MIRROR @ right[0], abs=1e-5)
    # A mirrored hand is a hand again once its own y axis is mirrored too.
    assert left[1] == pytest.approx(MIRROR @ right[1] @ MIRROR, abs=1e-4)


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("opening", [0.0, 0.02, GRIPPER_OPEN])
def test_the_opening_is_the_distance_between_the_pads(arm, opening):
    data = mujoco.MjData(MODEL)
    for finger in "ab":
        data.joint(f"{arm}_finger_{finger}").qpos = opening / 2
    mujoco.mj_kinematics(MODEL, data)
    pads = [data.geom(f"{arm}_pad_{finger}") for finger in "ab"]
    thickness = 2 * MODEL.geom(f"{arm}_pad_a").size[0]
    assert np.linalg.norm(pads[0].xpos - pads[1].xpos) == pytest.approx(opening + thickness)
    tips = [pad.xpos + 0.026 * pad.xmat.reshape(3, 3)[:, 2] for pad in pads]
    base, tcp = data.body(f"{arm}_gripper").xpos, data.site(f"{arm}_tcp").xpos
    assert np.linalg.norm(np.mean(tips, axis=0) - base) == pytest.approx(0.1359, abs=5e-4)
    assert np.linalg.norm(tcp - base) == pytest.approx(0.123)
