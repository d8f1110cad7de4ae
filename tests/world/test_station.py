"""Where things stand, and that they stay there."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.constants import ARMS, UPDATES_PER_CONTROL
from teasim.world.monitor import Monitor
from teasim.world.simulation import ENVIRONMENT_STATE_NAMES, Simulation
from teasim.world.station import (
    FREE_BODIES,
    IN_HOLDER,
    KNOB_RANGE,
    NOMINAL,
    POSITION_RANGE,
    VESSEL_GAP,
    YAW_RANGE,
    Layout,
    Placement,
    body_name,
    nominal_layout,
    place,
    sample_layout,
    station_model,
)

ANGLES = st.floats(-np.pi, np.pi)
THINGS = (*FREE_BODIES, "knob", "tea_bag_holder", "spoon_holder")
SECOND = 10  # control steps


def layout(seed: int) -> Layout:
    return sample_layout(np.random.default_rng(seed))


@given(yaw=ANGLES, tilt=ANGLES)
def test_a_placement_turns_about_the_vertical_and_leans_about_its_own_y(yaw, tilt):
    turn, lean, both = np.zeros(4), np.zeros(4), np.zeros(4)
    mujoco.mju_axisAngle2Quat(turn, np.array([0.0, 0.0, 1.0]), yaw)
    mujoco.mju_axisAngle2Quat(lean, np.array([0.0, 1.0, 0.0]), tilt)
    mujoco.mju_mulQuat(both, turn, lean)
    assert Placement(0, 0, 0, yaw, tilt).quaternion == pytest.approx(both, abs=1e-12)


@pytest.mark.parametrize("name", NOMINAL)
def test_layouts_fill_their_ranges_and_stay_inside(name):
    nominal, placements = NOMINAL[name], [layout(seed)[name] for seed in range(200)]
    reach, turn = (KNOB_RANGE, 0) if name == "knob" else (POSITION_RANGE, YAW_RANGE)
    offsets = np.array([(p.x - nominal.x, p.y - nominal.y) for p in placements])
    turns = np.array([p.yaw - nominal.yaw for p in placements])
    for values, limit in ((offsets[:, 0], reach), (offsets[:, 1], reach), (turns, turn)):
        assert np.abs(values).max() <= limit
        assert values.max() >= 0.8 * limit
        assert values.min() <= -0.8 * limit
    assert {(p.z, p.tilt) for p in placements} == {(nominal.z, nominal.tilt)}


def test_the_ranges_are_three_centimetres_and_ten_degrees():
    assert (POSITION_RANGE, KNOB_RANGE) == (0.03, 0.015)
    assert np.degrees(YAW_RANGE) == pytest.approx(10)


def test_a_hand_always_fits_between_sugar_pot_and_milk_jug():
    gaps = [layout(seed)["sugar_pot"].y - layout(seed)["milk_jug"].y for seed in range(200)]
    assert min(gaps) >= VESSEL_GAP


def test_a_seed_gives_one_layout():
    assert layout(3).placements == layout(3).placements
    assert layout(3).placements != layout(4).placements


def test_a_layout_is_read_only():
    with pytest.raises(TypeError):
        nominal_layout().placements["cup"] = Placement(0, 0)  # type: ignore[index]


def test_placing_puts_everything_where_the_layout_says():
    model, wanted = station_model(), layout(0)
    data = mujoco.MjData(model)
    place(model, data, wanted)
    mujoco.mj_forward(model, data)
    for name in THINGS:
        at, body = wanted[name], data.body(body_name(name))
        assert body.xpos == pytest.approx([at.x, at.y, at.z])
        assert abs(body.xquat @ at.quaternion) == pytest.approx(1)
    for name, (holder, _, _) in IN_HOLDER.items():
        assert wanted[name].x == wanted[holder].x


def test_models_do_not_share_what_a_layout_writes():
    first, second = station_model(), station_model()
    place(first, mujoco.MjData(first), layout(0))
    assert second.body("knob").pos == pytest.approx([NOMINAL["knob"].x, NOMINAL["knob"].y, 0.04])


@pytest.mark.parametrize("seed", range(3))
def test_things_at_rest_stay_at_rest(seed):
    simulation = Simulation()
    monitor = Monitor(simulation)
    simulation.reset(layout(seed))
    before = simulation.environment_state()
    for _ in range(SECOND):
        simulation.step(simulation.target)
    after = simulation.environment_state()
    for k, name in enumerate(ENVIRONMENT_STATE_NAMES):
        # A leaning spoon creeps in its holder; it must not do so visibly.
        turning = name.endswith(("_qw", "_qx", "_qy", "_qz"))
        assert abs(after[k] - before[k]) < (2e-3 if turning else 5e-4), name
    assert simulation.events == ()
    assert simulation.data.time == pytest.approx(SECOND / 10)
    assert not [pair for pair in monitor.touches if "arm" in str(pair) or "fingers" in str(pair)]


@pytest.mark.parametrize("seed", range(3))
def test_everything_settles_near_its_place(seed):
    simulation, wanted = Simulation(), layout(seed)
    simulation.reset(wanted)
    for name in FREE_BODIES:
        body = simulation.data.body(body_name(name))
        assert np.hypot(body.xpos[0] - wanted[name].x, body.xpos[1] - wanted[name].y) < 0.006
        assert body.xmat[8] > np.cos(np.radians(15))


def test_a_reset_forgets_what_was():
    used, fresh = Simulation(), Simulation()
    used.reset(layout(5))
    used.data.joint("knob").qpos = np.pi / 2
    used.liquids.cup["water"] = 50.0
    target = used.target.copy()
    target[[2, 14]] += 0.02
    for _ in range(3):
        used.step(target)
    assert used.subtasks_done == ("turn_on_oven",)
    for simulation in (used, fresh):
        simulation.reset(layout(6))
        simulation.step(simulation.target)
    assert used.data.qpos.tobytes() == fresh.data.qpos.tobytes()
    assert used.environment_state().tobytes() == fresh.environment_state().tobytes()
    assert (used.events, used.oven_on) == ((), False)


def test_observers_look_after_every_update(simulation):
    times = []
    simulation.observers.append(lambda: times.append(simulation.data.time))
    simulation.step(simulation.target)
    assert times == pytest.approx(np.arange(1, UPDATES_PER_CONTROL + 1) / 50)


def test_states_are_new_arrays_of_what_their_names_say(simulation):
    state, joints = simulation.environment_state(), simulation.joint_state()
    assert (state.shape, state.dtype) == ((len(ENVIRONMENT_STATE_NAMES),), np.float32)
    assert (joints.shape, joints.dtype) == ((16,), np.float32)
    named = dict(zip(ENVIRONMENT_STATE_NAMES, state, strict=True))
    assert named["kettle_x"] == pytest.approx(NOMINAL["kettle"].x, abs=1e-3)
    assert named["kettle_qw"] == pytest.approx(np.cos(np.pi / 4), abs=1e-3)
    assert (named["kettle_amount"], named["milk_jug_amount"], named["cup_tea"]) == (100, 50, 0)
    state[:], joints[:] = 0, 0
    assert simulation.environment_state().any()
    assert simulation.joint_state().any()


@pytest.mark.parametrize("arm", ARMS)
@pytest.mark.parametrize("thing", [*FREE_BODIES, "knob"])
def test_a_hand_and_what_it_sees_of_a_thing_give_the_things_place(arm, thing):
    simulation = Simulation()
    simulation.reset(sample_layout(np.random.default_rng(4)))
    named = dict(zip(ENVIRONMENT_STATE_NAMES, simulation.environment_state(), strict=True))

    def read(pose):
        numbers = np.array([named[f"{pose}_{part}"] for part in ("x", "y", "z")], dtype=float)
        turn = np.array([named[f"{pose}_q{part}"] for part in "wxyz"], dtype=float)
        assert turn[0] >= 0
        assert np.linalg.norm(turn) == pytest.approx(1)
        matrix = np.empty(9)
        mujoco.mju_quat2Mat(matrix, turn)
        return numbers, matrix.reshape(3, 3)

    place, turn = read(f"{arm}_hand")
    away, turned = read(f"{thing}_in_{arm}_hand")
    body = simulation.data.body(body_name(thing))
    np.testing.assert_allclose(place + turn @ away, body.xpos, atol=1e-5)
    np.testing.assert_allclose(turn @ turned, body.xmat.reshape(3, 3), atol=1e-5)
    np.testing.assert_allclose(place, simulation.data.site(f"{arm}_tcp").xpos, atol=1e-6)
