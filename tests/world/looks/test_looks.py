"""A look changes the picture and nothing else, stays in its ranges, and can be replaced."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from teasim.common.errors import ConfigError
from teasim.constants import CAMERAS, SUBTASKS
from teasim.render import StationRenderer
from teasim.rollout import demonstrate
from teasim.task.mistakes import Plan
from teasim.task.recipes import SEQ_1
from teasim.world.looks import look as looks
from teasim.world.looks.dressing import apply_look
from teasim.world.looks.look import (
    DISTRACTORS,
    ZONES,
    CameraShift,
    Cloth,
    Distractor,
    Look,
    Tint,
    fixed_look,
    sample_look,
)
from teasim.world.simulation import Simulation
from teasim.world.station import NOMINAL, POSITION_RANGE, nominal_layout, station_model

SEEDS = st.integers(0, 2**32)
EVERYTHING = Look(
    cloth=Cloth("check"),
    wall=(0.6, 0.6, 0.6),
    distractors=tuple(
        Distractor(name, x, y)
        for name, x, y in (
            ("plate", 0.68, 0.40),
            ("book", 0.68, -0.22),
            ("box", 0.67, -0.36),
            ("bottle", -0.21, -0.45),
            ("plant", -0.22, 0.45),
        )
    ),
)


def look(seed: int) -> Look:
    return sample_look(np.random.default_rng(seed))


def written(model: mujoco.MjModel) -> list[list[float]]:
    """Everything of a model that a look writes, places of hidden things aside."""
    names = ["light_pos", "light_dir", "light_diffuse", "light_specular", "mat_rgba", "cam_pos"]
    names += ["cam_quat", "cam_fovy", "geom_rgba", "geom_group"]
    headlight = model.vis.headlight
    parts = [getattr(model, name) for name in names]
    return [part.ravel().tolist() for part in (*parts, headlight.ambient, headlight.diffuse)]


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS)
def test_sampled_looks_stay_in_their_ranges(seed):
    found = look(seed)
    assert looks.LIGHT_BRIGHTNESS[0] <= found.light.brightness <= looks.LIGHT_BRIGHTNESS[1]
    assert looks.LIGHT_AMBIENT[0] <= found.light.ambient <= looks.LIGHT_AMBIENT[1]
    assert abs(found.light.lean) <= looks.LIGHT_LEAN
    assert np.abs(np.array(found.light.colour) - 1).max() <= looks.LIGHT_TINGE
    assert [shift.camera for shift in found.cameras] == list(CAMERAS)
    for shift in found.cameras:
        assert np.abs(shift.offset).max() <= looks.CAMERA_OFFSET
        assert np.abs(shift.turn).max() <= looks.CAMERA_TURN
        assert looks.CAMERA_ZOOM[0] <= shift.zoom <= looks.CAMERA_ZOOM[1]
    for tint in found.tints:
        assert looks.TINT[0] <= min(tint.factor) <= max(tint.factor) <= looks.TINT[1]
    assert found == look(seed)


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS)
def test_distractors_stand_in_a_zone_and_apart(seed):
    things = look(seed).distractors
    assert len(things) <= looks.MOST_DISTRACTORS
    for k, thing in enumerate(things):
        kind = DISTRACTORS[thing.name]
        assert any(
            zone.fits(kind)
            and zone.x[0] <= thing.x - kind.radius <= thing.x + kind.radius <= zone.x[1]
            and zone.y[0] <= thing.y - kind.radius <= thing.y + kind.radius <= zone.y[1]
            for zone in ZONES
        )
        for other in things[:k]:
            gap = np.hypot(thing.x - other.x, thing.y - other.y)
            assert gap > kind.radius + DISTRACTORS[other.name].radius


def test_looks_differ_and_every_kind_of_thing_turns_up():
    found = [look(seed) for seed in range(150)]
    assert len(set(found)) == len(found)
    assert {thing.name for one in found for thing in one.distractors} == set(DISTRACTORS)
    assert {one.cloth.pattern for one in found if one.cloth} == set(looks.PATTERNS)
    assert {len(one.distractors) for one in found} == set(range(looks.MOST_DISTRACTORS + 1))


@pytest.mark.parametrize("worn", [Look(), EVERYTHING, look(3), look(4)])
def test_the_fixed_look_is_the_scene_as_compiled_whatever_was_worn_before(worn):
    model = station_model()
    before = written(model)
    apply_look(model, fixed_look())
    assert written(model) == before
    apply_look(model, worn)
    assert (written(model) == before) == (worn == Look())
    apply_look(model, fixed_look())
    assert written(model) == before


def test_a_model_remembers_nothing_of_the_look_before():
    one, other = station_model(), station_model()
    apply_look(one, EVERYTHING)
    for model in (one, other):
        apply_look(model, look(7))
    assert written(one) == written(other)


def test_distractors_are_as_large_as_said_and_touch_nothing():
    model = station_model()
    apply_look(model, EVERYTHING)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for thing in EVERYTHING.distractors:
        kind, body = DISTRACTORS[thing.name], model.body(f"distractor_{thing.name}")
        for geom in range(body.geomadr[0], body.geomadr[0] + body.geomnum[0]):
            assert (model.geom_contype[geom], model.geom_conaffinity[geom]) == (0, 0)
            centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
            offset = model.geom_pos[geom]
            round_ = model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_BOX
            reach = max(half[:2]) if round_ else np.hypot(*half[:2])
            assert np.hypot(*(centre + offset)[:2]) + reach <= kind.radius + 1e-6
            assert (centre + offset + half)[2] <= kind.height + 1e-6
        assert data.body(body.id).xpos == pytest.approx([thing.x, thing.y, 0])
        assert model.body_mass[body.id] == 0


def test_zones_are_on_the_table_and_away_from_what_is_handled():
    table = station_model().geom("table")
    for zone in ZONES:
        for axis, (low, high) in enumerate((zone.x, zone.y)):
            assert abs(low - table.pos[axis]) <= table.size[axis]
            assert abs(high - table.pos[axis]) <= table.size[axis]
        for at in NOMINAL.values():
            away = [
                max(low - v, v - high, 0) for (low, high), v in ((zone.x, at.x), (zone.y, at.y))
            ]
            assert np.hypot(*away) > POSITION_RANGE + 0.02


def test_nothing_that_moves_comes_into_a_zone():
    simulation = Simulation()
    model, data = simulation.model, simulation.data
    shown = (model.geom_group == 2) & (model.geom_type == mujoco.mjtGeom.mjGEOM_MESH)
    moving = np.flatnonzero(shown & (model.body_weldid[model.geom_bodyid] != 0))
    corners = {}
    for geom in moving:
        mesh = model.geom_dataid[geom]
        start, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        corners[geom] = model.mesh_vert[start : start + count]
    for count, step in enumerate(demonstrate(simulation, Plan(SEQ_1), np.random.default_rng(2))):
        if count % 3:
            continue  # nothing is so quick that it would pass in between
        points = np.concatenate(
            [
                corners[geom] @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
                for geom in moving
            ]
        )
        for zone in ZONES:
            low, high = np.transpose([zone.x, zone.y, (0, zone.clearance)])
            inside = (low <= points) & (points <= high)
            assert not inside.all(axis=1).any(), step.subtask
    assert set(simulation.subtasks_done) == set(SUBTASKS)


def test_physics_knows_nothing_of_looks():
    states = []
    for worn in (fixed_look(), EVERYTHING, look(1)):
        simulation = Simulation()
        simulation.reset(nominal_layout())
        for step in range(20):
            if step == 10:
                apply_look(simulation.model, worn, simulation.data)
            target = simulation.target + np.where(np.arange(16) == 3, 0.01, 0)
            simulation.step(target)
        states.append(simulation.data.qpos.tobytes() + simulation.data.qvel.tobytes())
    assert len(set(states)) == 1


def test_pictures_repeat_with_the_look_and_return_with_the_fixed_one(simulation):
    with StationRenderer(simulation, width=96, height=96, look=look(2)) as renderer:
        dressed = renderer.picture("left")
        renderer.wear(fixed_look())
        plain = renderer.picture("left")
        renderer.wear(look(2))
        assert np.array_equal(renderer.picture("left"), dressed)
        assert not np.array_equal(plain, dressed)
    apply_look(simulation.model, fixed_look(), simulation.data)
    with StationRenderer(simulation, width=96, height=96) as renderer:
        assert np.array_equal(renderer.picture("left"), plain)


def test_no_sampled_look_is_over_exposed_or_dark(simulation):
    with StationRenderer(simulation, width=64, height=64) as renderer:
        for seed in range(12):
            renderer.wear(look(seed))
            picture = renderer.picture("left")
            assert (picture == 255).all(axis=-1).mean() < 0.06
            assert 40 < picture.mean() < 200


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Cloth("dots"), "Unknown pattern 'dots'; choose plain, stripes, check."),
        (lambda: Tint("table", (1, 1, 1)), "Unknown thing to tint 'table'; choose kettle, cup,"),
        (lambda: CameraShift("side"), "Unknown camera 'side'; choose left, cup, front, top."),
        (lambda: Distractor("cat", 0, 0), "Unknown distractor 'cat'; choose plate, bottle,"),
        (lambda: Look(table=(0, 0, 2)), "The colour of the table is (0, 0, 2); choose three"),
        (
            lambda: replace(EVERYTHING, distractors=EVERYTHING.distractors[:1] * 2),
            "The distractor 'plate' is given twice; give it once.",
        ),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(make, words):
    with pytest.raises(ConfigError) as caught:
        make()
    assert words in str(caught.value)
