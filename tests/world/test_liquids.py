"""Liquids flow when a vessel is tilted, land where the spout is, and none gets lost."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from teasim.world.liquids import (
    CONTENTS,
    CUP_RADIUS,
    FLOW_LIMIT,
    LOBES,
    RIM_HEIGHT,
    VESSELS,
    Liquids,
    held_volume,
    puddle_shape,
)
from teasim.world.simulation import Simulation
from teasim.world.station import HOB_HEIGHT, body_name, nominal_layout, place, station_model

DT = 0.02
RIGHT_ANGLE = np.pi / 2
ABOVE = np.array([0.0, 0.0, RIM_HEIGHT + 0.02])

# Tilt [deg] at which it begins to flow from a vessel filled to 80, 60, 50 and 30 % (a volume count
# on a grid of points, made for another programme).
FLOW_STARTS = {
    "kettle": (22, 38, 44, 56),
    "milk_jug": (28, 46, 52, 64),
    "sugar_pot": (24, 42, 48, 60),
}


class Table:
    """The station without time: vessels are put somewhere, tilted, and pour."""

    def __init__(self) -> None:
        self.model = station_model()
        self.data = mujoco.MjData(self.model)
        place(self.model, self.data, nominal_layout())
        mujoco.mj_kinematics(self.model, self.data)
        self.liquids = Liquids(self.model)
        self.cup = self.data.body("cup/cup").xpos.copy()

    def tilt(self, name: str, angle: float, spout: np.ndarray, axis=(0.0, 1.0, 0.0)) -> None:
        """Turn a vessel about `axis` by `angle` [rad], its spout at `spout` (3,) [m]."""
        quaternion, offset = np.zeros(4), np.zeros(3)
        mujoco.mju_axisAngle2Quat(quaternion, np.array(axis), angle)
        mujoco.mju_rotVecQuat(offset, self.model.site(f"{name}/spout").pos, quaternion)
        self.data.joint(body_name(name)).qpos = [*(spout - offset), *quaternion]
        mujoco.mj_kinematics(self.model, self.data)

    def flow(self, seconds: float, *, brewing: bool = False, stirring: bool = False) -> None:
        for _ in range(round(seconds / DT)):
            self.liquids.update(self.data, DT, brewing=brewing, stirring=stirring)


@pytest.fixture
def table():
    return Table()


def total(liquids: Liquids, name: str) -> float:
    content = VESSELS[name].content
    return liquids.amounts[name] + liquids.cup[content] + liquids.spilled[content]


@pytest.mark.parametrize("name", VESSELS)
def test_an_upright_vessel_holds_its_volume_and_a_lying_one_nothing(name):
    vessel = VESSELS[name]
    capacity = np.pi * vessel.radius**2 * vessel.height * 1e6
    assert held_volume(vessel, 0.0) == pytest.approx(capacity, rel=0.005)
    assert vessel.filling < capacity
    assert held_volume(vessel, RIGHT_ANGLE) == 0
    assert held_volume(vessel, np.pi) == 0


@pytest.mark.parametrize("name", VESSELS)
@given(angles=st.lists(st.floats(0, np.pi), min_size=2, max_size=2))
def test_the_more_tilt_the_less_is_held(name, angles):
    less, more = sorted(angles)
    assert held_volume(VESSELS[name], less) >= held_volume(VESSELS[name], more)


@pytest.mark.parametrize("name", VESSELS)
def test_fuller_vessels_flow_earlier(name):
    vessel = VESSELS[name]
    for share, degrees in zip((0.8, 0.6, 0.5, 0.3), FLOW_STARTS[name], strict=True):
        held = [held_volume(vessel, np.radians(degrees + d)) for d in (-3, 3)]
        assert held[1] < share * held_volume(vessel, 0) < held[0]


@pytest.mark.parametrize("name", VESSELS)
def test_over_the_cup_everything_lands_in_it_and_nothing_is_lost(table, name):
    content, filling = VESSELS[name].content, VESSELS[name].filling
    for degrees in range(0, 101, 2):
        before = table.liquids.amounts[name]
        table.tilt(name, np.radians(degrees), table.cup + ABOVE)
        table.flow(0.1)
        assert total(table.liquids, name) == pytest.approx(filling)
        assert before - table.liquids.amounts[name] <= FLOW_LIMIT * 0.1 + 1e-9
    table.flow(2.0)
    assert table.liquids.cup[content] == pytest.approx(filling, abs=0.01)
    assert table.liquids.spilled[content] == 0
    assert table.liquids.streams == ()


@pytest.mark.parametrize("name", VESSELS)
@pytest.mark.parametrize(
    ("offset", "axis"),
    [
        ((0.0, 0.10, 0.10), (0, 1, 0)),  # beside the cup
        ((0.0, 0.0, 0.05), (0, 1, 0)),  # below its rim
        ((0.0, 0.0, 0.10), (1, 0, 0)),  # over it, but tilted sideways: not out of the spout
        ((0.0, 0.0, 0.10), (0, -1, 0)),  # or backwards
    ],
)
def test_elsewhere_it_is_spilled(table, name, offset, axis):
    content, filling = VESSELS[name].content, VESSELS[name].filling
    spout = table.cup + np.array(offset)
    table.tilt(name, np.radians(100), spout, axis)
    table.flow(0.2)
    assert len(table.liquids.streams) == 1
    table.flow(5.0)
    assert table.liquids.cup[content] == 0
    assert table.liquids.spilled[content] == pytest.approx(filling, abs=0.01)
    assert table.liquids.puddles[content] == pytest.approx(spout[:2])


def test_a_cup_that_lies_catches_nothing(table):
    table.data.joint("cup/cup").qpos[3:] = [np.cos(0.5), np.sin(0.5), 0, 0]
    table.tilt("kettle", RIGHT_ANGLE, table.data.body("cup/cup").xpos + ABOVE)
    table.flow(4.0)
    assert table.liquids.cup["water"] == 0


def test_a_kettle_on_its_side_spills_in_physics(simulation):
    joint = simulation.data.joint("kettle/kettle")
    joint.qpos = [0.2, -0.2, 0.045, np.cos(np.pi / 4), 0, np.sin(np.pi / 4), 0]
    before = simulation.liquids.amounts["kettle"]
    for _ in range(30):
        simulation.step(simulation.target)
    spilled = simulation.liquids.spilled["water"]
    assert spilled > 0.9 * before
    assert spilled + simulation.liquids.amounts["kettle"] == pytest.approx(before)
    assert simulation.events == ()


@pytest.mark.parametrize("water", [0.0, 100.0])
@pytest.mark.parametrize("brewing", [False, True])
def test_tea_needs_water_and_a_bag(table, water, brewing):
    table.liquids.cup["water"] = water
    table.flow(5.0, brewing=brewing)
    assert (table.liquids.tea > 0) == (brewing and water > 0)
    assert table.liquids.tea < 1


def test_stirring_mixes_and_makes_tea_stronger_sooner(table):
    liquids = table.liquids
    liquids.cup["water"] = 100.0
    table.flow(1.0, brewing=True)
    still, unmixed = liquids.tea, liquids.mixed
    table.flow(1.0, brewing=True, stirring=True)
    assert liquids.tea - still > 2 * still
    assert unmixed == 0
    assert 0 < liquids.mixed < 1


def test_tea_darkens_the_cup_and_milk_whitens_it(table):
    liquids = table.liquids
    liquids.cup["water"] = 100.0
    water = liquids.colour.mean()
    liquids.tea = 1.0
    tea = liquids.colour.mean()
    liquids.cup["milk"] = 50.0
    liquids.mixed = 1.0
    milk_tea = liquids.colour.mean()
    assert tea < milk_tea
    assert tea < water
    assert ((liquids.colour >= 0) & (liquids.colour <= 1)).all()


def test_levels_can_be_seen(table):
    model, liquids = table.model, table.liquids
    cup, kettle = model.geom("cup/content"), model.geom("kettle/content")
    liquids.paint(model, table.data)
    empty, full = cup.pos[2], kettle.pos[2]
    assert (cup.rgba[3], kettle.rgba[3], model.geom("spill_water_0").rgba[3]) == (0, 1, 0)
    liquids.amounts["kettle"], liquids.cup["water"], liquids.spilled["water"] = 0.0, 80.0, 20.0
    liquids.paint(model, table.data)
    assert cup.pos[2] - empty == pytest.approx(80e-6 / (np.pi * CUP_RADIUS**2))
    assert kettle.pos[2] < full
    assert (cup.rgba[3], kettle.rgba[3]) == (1, 0)
    assert model.geom("spill_water_0").rgba[3] > 0
    assert model.geom("spill_milk_0").rgba[3] == 0


HOB = (0.43, -0.32)  # its middle, and 14 x 15 cm from there to its edges
HALF = (0.14, 0.15)


@pytest.mark.parametrize("content", CONTENTS)
@pytest.mark.parametrize(
    ("at", "height"),
    [
        (HOB, HOB_HEIGHT),
        ((0.55, -0.20), HOB_HEIGHT),  # near a corner
        ((0.30, -0.46), HOB_HEIGHT),
        ((0.42, 0.10), 0.0),
        ((0.43, -0.10), 0.0),
    ],
)
def test_a_puddle_lies_where_the_liquid_lands(table, content, at, height):
    table.liquids.spilled[content], table.liquids.puddles[content] = 20.0, np.array(at)
    table.liquids.paint(table.model, table.data)
    lobes = [table.model.geom(puddle_shape(content, k)) for k in range(len(LOBES))]
    assert lobes[0].pos[2] == pytest.approx(height)
    for lobe in lobes:
        beyond = np.abs(lobe.pos[:2] - HOB) - HALF
        assert lobe.pos[2] == pytest.approx(HOB_HEIGHT if (beyond <= 0).all() else 0.0)
        if lobe.pos[2]:  # nothing hangs over an edge
            assert (beyond + lobe.size[:2] <= 1e-9).all()


def test_a_stream_ends_on_the_hob(table):
    table.tilt("kettle", np.radians(100), np.array([*HOB, 0.3]))
    table.flow(0.2)
    (stream,) = table.liquids.streams
    assert stream.end == pytest.approx([*HOB, HOB_HEIGHT])


def test_a_picture_shows_the_level_of_now_and_not_of_the_last_step():
    simulation = Simulation()
    simulation.reset(nominal_layout())
    model, data = simulation.model, simulation.data
    simulation.liquids.cup["water"] = 120.0
    simulation.paint()
    shown = data.geom("cup/content").xpos[2] - data.body("cup/cup").xpos[2]
    assert shown == pytest.approx(model.geom("cup/content").pos[2], abs=1e-4)
    assert shown > 0.03
