"""Masks name what is seen, depths say how far it is, and pictures stay what they were."""

from dataclasses import replace

import numpy as np
import pytest

from teasim.render import StationRenderer
from teasim.world.liquids import Stream
from teasim.world.looks.look import Cloth, Distractor, Look, sample_look
from teasim.world.segments import SEGMENT_NAMES, segments
from teasim.world.station import sample_layout

PROPS = ("kettle", "cup", "milk_jug", "sugar_pot", "tea_bag", "spoon", "holders", "hob", "knob")
NUMBER = {name: number for number, name in enumerate(SEGMENT_NAMES)}
SIDE = 224
UP = np.array([0.0, 0.0, 1.0])


def pixel(simulation, camera: str, point: np.ndarray) -> tuple[int, int, float]:
    """Row, column and distance along the axis [m] at which a camera sees a point (3,)."""
    lens = simulation.model.camera(camera)
    seen = simulation.data.camera(camera)
    x, y, z = seen.xmat.reshape(3, 3).T @ (point - seen.xpos)
    focus = SIDE / 2 / np.tan(np.radians(lens.fovy[0]) / 2)
    return round(SIDE / 2 - focus * y / -z), round(SIDE / 2 + focus * x / -z), -z


@pytest.fixture(params=["fast", "nice"])
def renderer(request, simulation):
    with StationRenderer(simulation, width=SIDE, height=SIDE, quality=request.param) as made:
        yield made


def test_every_shape_has_a_segment_and_every_segment_a_shape(simulation):
    model, numbers = simulation.model, segments(simulation.model)
    assert numbers.shape == (model.ngeom,)
    assert {SEGMENT_NAMES[k] for k in numbers} == set(SEGMENT_NAMES)
    for geom, number in enumerate(numbers):
        if SEGMENT_NAMES[number] == "torso":
            assert model.body(model.geom_bodyid[geom]).name.startswith("yumi")


def test_masks_and_depths_show_what_is_where_and_leave_pictures_alone(renderer, simulation):
    before = renderer.frames(("left", "cup"))
    masks, depths = renderer.masks(("left", "cup")), renderer.depths(("left", "cup"))
    after = renderer.frames(("left", "cup"))
    for camera in ("left", "cup"):
        mask, depth = masks[camera], depths[camera]
        assert (mask.shape, mask.dtype) == ((SIDE, SIDE), np.int32)
        assert (depth.shape, depth.dtype) == ((SIDE, SIDE), np.float32)
        assert depth.min() > 0
        assert np.array_equal(before[camera], after[camera])
        rim = simulation.data.body("cup/cup").xpos + 0.036 * UP
        row, column, away = pixel(simulation, camera, rim)
        assert mask[row, column] == NUMBER["cup"]
        rows, columns = np.nonzero(mask == NUMBER["cup"])
        assert np.hypot(rows.mean() - row, columns.mean() - column) < 0.06 * SIDE
        assert np.median(depth[mask == NUMBER["cup"]]) == pytest.approx(away, abs=0.045)
    counts = np.bincount(masks["left"].ravel(), minlength=len(SEGMENT_NAMES))
    assert min(counts[NUMBER[name]] for name in PROPS) >= 20
    assert min(counts[NUMBER[name]] for name in ("right_arm", "left_arm", "torso")) > 200


def test_streams_walls_cloths_and_distractors_are_told_apart(simulation):
    cup = simulation.data.body("cup/cup").xpos
    stream = Stream(cup + 0.15 * UP, cup + 0.05 * UP, (0.4, 0.7, 0.9, 0.9))
    simulation.liquids.streams = (stream,)
    worn = Look(
        cloth=Cloth("check"),
        wall=(0.6, 0.6, 0.6),
        distractors=(Distractor("bottle", -0.2, -0.45),),
    )
    with StationRenderer(simulation, width=SIDE, height=SIDE, look=worn) as renderer:
        mask = renderer.masks(("left",))["left"]
        renderer.wear(Look())
        bare = renderer.masks(("left",))["left"]
    row, column, _ = pixel(simulation, "left", cup + 0.12 * UP)
    assert (mask[row, column - 1 : column + 2] == NUMBER["stream"]).any()
    assert (mask == NUMBER["distractor"]).sum() > 20
    assert not (bare == NUMBER["distractor"]).any()
    same = mask != NUMBER["distractor"]
    table = NUMBER["table"]
    assert np.mean((mask == table)[same] == (bare == table)[same]) > 0.995
    assert (mask == NUMBER["background"]).sum() > (bare == NUMBER["background"]).sum()


def fields(structure) -> dict[str, object]:
    """All numbers of a MuJoCo structure by name, as bytes or nested."""
    found = {}
    for name in (name for name in dir(structure) if not name.startswith("_")):
        value = getattr(structure, name)
        if isinstance(value, np.ndarray):
            found[name] = value.tobytes()
        elif isinstance(value, int | float):
            found[name] = value
    return found


@pytest.mark.parametrize("quality", ["fast", "nice"])
def test_a_closed_renderer_leaves_the_model_as_it_was(simulation, quality):
    model = simulation.model

    def everything() -> list[dict[str, object]]:
        vis = model.vis
        return [fields(part) for part in (model, vis.map, vis.quality, vis.global_, vis.headlight)]

    before = everything()
    look = sample_look(np.random.default_rng(3))
    worn = replace(look, cloth=Cloth("check"), distractors=(Distractor("bottle", -0.2, -0.45),))
    with StationRenderer(simulation, width=48, height=40, quality=quality, look=worn) as renderer:
        simulation.liquids.spilled["water"] = 50.0
        renderer.picture("left")
        assert everything() != before
    assert everything() == before


@pytest.mark.parametrize("name", PROPS)
def test_the_front_camera_shows_everything(simulation, name):
    for seed in range(5):
        simulation.reset(sample_layout(np.random.default_rng(seed)))
        geoms = np.flatnonzero(segments(simulation.model) == NUMBER[name])
        for geom in geoms:
            middle, reach = simulation.data.geom_xpos[geom], simulation.model.geom_rbound[geom]
            row, column, away = pixel(simulation, "front", middle)
            margin = reach * SIDE / 2 / np.tan(np.radians(48) / 2) / away
            assert margin <= row <= SIDE - margin
            assert margin <= column <= SIDE - margin


def test_a_quality_leaves_nothing_behind_for_the_next(simulation):
    pictures = []
    for quality in ("fast", "nice", "fast"):
        with StationRenderer(simulation, width=96, height=96, quality=quality) as renderer:
            pictures.append(renderer.picture("left"))
            distances = renderer.depths(("left",))["left"]
            assert distances.shape == pictures[-1].shape[:2] == (96, 96)
    assert np.array_equal(pictures[0], pictures[2])
    assert not np.array_equal(pictures[0], pictures[1])
