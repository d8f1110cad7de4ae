"""A person at the station: two hands in physics, and a body that is drawn after them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.common.errors import ConfigError
from teasim.constants import ARMS
from teasim.world.bodies.embodiments import EMBODIMENTS, PERSON, find_embodiment
from teasim.world.bodies.person import (
    FOREARM,
    SHOULDERS,
    UPPER_ARM,
    WRIST,
    Appearance,
    elbow_of,
    lean_towards,
)
from teasim.world.monitor import roles
from teasim.world.simulation import Simulation
from teasim.world.station import FREE_BODIES, nominal_layout, station_model

MODEL = station_model("person")
PLACES = st.tuples(st.floats(0, 0.6), st.floats(-0.5, 0.5), st.floats(0.05, 0.4)).map(np.array)


@pytest.fixture
def person():
    simulation = Simulation("person")
    simulation.reset(nominal_layout())
    return simulation


def test_an_unknown_embodiment_is_named():
    with pytest.raises(ConfigError) as error:
        find_embodiment("cat")
    assert str(error.value) == "Unknown embodiment 'cat'; choose yumi, person."
    with pytest.raises(ConfigError, match="Unknown embodiment 'cat'"):
        Simulation("cat")


@pytest.mark.parametrize("embodiment", EMBODIMENTS.values(), ids=lambda body: body.name)
def test_every_embodiment_fits_its_model(embodiment):
    model = station_model(embodiment.name)
    for arm in ARMS:
        ready = embodiment.ready[arm]
        ranges = np.array([model.joint(name).range for name in embodiment.joints[arm]])
        motors = np.array([model.actuator(name).ctrlrange for name in embodiment.joints[arm]])
        assert ready.shape == embodiment.bow.shape == embodiment.arc.shape == (embodiment.width,)
        assert motors == pytest.approx(ranges)
        assert (embodiment.limits[:, 0] >= ranges[:, 0]).all()
        assert (embodiment.limits[:, 1] <= ranges[:, 1]).all()
        assert ((embodiment.limits[:, 0] < ready) & (ready < embodiment.limits[:, 1])).all()
    assert (embodiment.reach_speeds <= embodiment.speeds).all()


def test_a_target_has_six_coordinates_per_hand_and_two_openings(person):
    assert person.target.shape == person.joint_state().shape == (14,)


def test_every_shape_of_a_person_has_a_role():
    named = set(roles(MODEL))
    parts = {f"{side}_{part}" for side in ARMS for part in ("arm", "fingers")}
    assert {*parts, "torso", "table", "hob", "knob", *FREE_BODIES} <= named


def test_only_hands_collide():
    drawn_only = [g for g in range(MODEL.ngeom) if MODEL.geom(g).name.startswith("person_")]
    assert {roles(MODEL)[geom] for geom in drawn_only} == {"right_arm", "left_arm", "torso"}
    for geom in drawn_only:
        assert MODEL.geom_contype[geom] == MODEL.geom_conaffinity[geom] == 0


@pytest.mark.parametrize("arm", ARMS)
def test_fingers_grip_like_the_robots(arm):
    robot = station_model()
    for pad in (f"{arm}_pad_a", f"{arm}_pad_b"):
        ours, theirs = MODEL.geom(pad), robot.geom(pad)
        for quantity in ("size", "friction", "solref", "solimp", "condim", "priority"):
            assert getattr(ours, quantity) == pytest.approx(getattr(theirs, quantity)), quantity
    motor = f"{arm}_gripper"
    assert MODEL.actuator(motor).forcerange == pytest.approx(robot.actuator(motor).forcerange)
    assert MODEL.actuator(motor).gainprm == pytest.approx(robot.actuator(motor).gainprm)


def test_hands_are_mirror_images(person):
    """In their rest pose everything that is seen of the left hand has its like in the right one."""
    places = {arm: drawn(person, arm) for arm in ARMS}
    assert places["right"].shape == places["left"].shape
    assert places["right"] * (1, -1, 1) == pytest.approx(places["left"], abs=1e-3)


def drawn(simulation: Simulation, arm: str) -> np.ndarray:
    """Middles (n, 3) of the shapes one sees of a hand, by height."""
    model = simulation.model
    shown = [
        geom
        for geom in range(model.ngeom)
        if model.geom_group[geom] == 2 and model.body(model.geom_bodyid[geom]).name.startswith(arm)
    ]
    return simulation.data.geom_xpos[shown]


def test_gravity_does_not_pull_the_hands_down(person):
    before = person.joint_state()
    for _ in range(10):
        person.step(person.target)
    assert person.joint_state() == pytest.approx(before, abs=1e-3)


@given(right=PLACES, left=PLACES)
def test_arms_have_their_lengths_wherever_the_hands_are(right, left):
    for arm, wrist in (("right", right), ("left", left)):
        shoulder = SHOULDERS[arm] + lean_towards({arm: wrist})
        elbow = elbow_of(arm, shoulder, wrist, np.array([0.0, 0.0, -1.0]))
        assert np.linalg.norm(elbow - shoulder) == pytest.approx(UPPER_ARM, abs=1e-6)
        assert np.linalg.norm(elbow - wrist) == pytest.approx(FOREARM, abs=1e-6)


def test_nobody_leans_who_can_reach():
    near = {arm: SHOULDERS[arm] + (0.3, 0.0, -0.2) for arm in ARMS}
    assert lean_towards(near) == pytest.approx(np.zeros(3))


def test_the_forearm_ends_at_the_wrist(person):
    person.paint()
    for arm in ARMS:
        geom = person.model.geom(f"person_{arm}_forearm").id
        hand = person.data.body(f"{arm}_hand")
        wrist = hand.xpos + hand.xmat.reshape(3, 3) @ WRIST
        middle = person.data.geom_xpos[geom]
        along = person.data.geom_xmat[geom].reshape(3, 3)[:, 2]
        assert np.linalg.norm(wrist - middle) == pytest.approx(FOREARM / 2, abs=1e-6)
        assert abs(along @ (wrist - middle)) == pytest.approx(FOREARM / 2, abs=1e-6)


def test_looking_changes_nothing(person):
    other = Simulation("person")
    other.reset(nominal_layout())
    target = person.target.copy()
    target[:3] += 0.05
    for _ in range(3):
        person.paint()
        person.step(target)
        other.step(target)
    assert person.data.qpos.tobytes() == other.data.qpos.tobytes()


def test_clothes_are_those_of_one_simulation(person):
    person.dress(Appearance((0.5, 0.4, 0.3), (0.1, 0.2, 0.3), (0.9, 0.8, 0.7)))
    assert person.model.mat("right_skin").rgba[:3] == pytest.approx((0.5, 0.4, 0.3))
    assert person.model.mat("left_skin").rgba[:3] == pytest.approx((0.5, 0.4, 0.3))
    assert person.model.mat("person_sleeve").rgba[:3] == pytest.approx((0.1, 0.2, 0.3))
    assert person.model.mat("person_shirt").rgba[:3] == pytest.approx((0.9, 0.8, 0.7))
    assert Simulation("person").model.mat("right_skin").rgba[0] != pytest.approx(0.5)


def test_ready_hands_rest_above_the_table():
    for arm in ARMS:
        assert 0.05 < PERSON.ready[arm][2] < 0.2
