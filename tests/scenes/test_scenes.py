"""Laws of all scenes: their plans are legal, their worlds repeat, and their effects are seen."""

from collections.abc import Sequence

import numpy as np
import pytest
from scenes.registry import HELD_BACK, SCENES, TUNED_ON
from scenes.scene import KINDS, Scene, is_legal, legal_order, make_plan

FRAMES = 20
"""Calls per step."""
SEEN, PIXELS = 20, 15
"""Change of a pixel that is seen, 0..255, and how many such pixels an effect has to have."""

GANTRIES = ("tabletop", "stack", "drawers", "lunch")
"""Scenes that MuJoCo renders: each of their worlds takes a while to build."""

each_scene = pytest.mark.parametrize("scene", SCENES.values(), ids=list(SCENES))
each_scene_patiently = pytest.mark.parametrize(
    "scene",
    [
        pytest.param(scene, id=name, marks=[pytest.mark.slow] if name in GANTRIES else [])
        for name, scene in SCENES.items()
    ],
)


def last_pictures(scene: Scene, acts: Sequence[tuple[str, bool]], seed: int = 0) -> np.ndarray:
    """Return what all cameras see at rest after some acts."""
    world = scene.world(np.random.default_rng(seed))
    world.rest()
    for step, works in acts:
        for frame in range(1, FRAMES + 1):
            world.move(step, frame / FRAMES, works)
        world.rest()
    pictures = world.pictures()
    if hasattr(world, "close"):
        world.close()
    assert set(pictures) == set(scene.cameras)
    return np.concatenate([pictures[camera] for camera in scene.cameras])


def test_a_scene_is_tuned_on_or_kept_back():
    assert not {s.name for s in TUNED_ON} & {s.name for s in HELD_BACK}
    assert len(SCENES) == len(TUNED_ON) + len(HELD_BACK)


@each_scene
def test_a_scene_names_only_its_steps(scene):
    named = {*scene.waits, *(first for firsts in scene.waits.values() for first in firsts)}
    assert named | set(scene.optional) <= set(scene.steps)
    assert scene.spares
    assert not set(scene.spares) & set(scene.steps)


@each_scene
def test_no_step_of_a_legal_order_comes_before_one_it_waits_for(scene):
    drawn = legal_order(scene, scene.steps, np.random.default_rng(0))
    for order in (list(scene.steps), drawn):
        for step, firsts in scene.waits.items():
            assert all(order.index(first) < order.index(step) for first in firsts)
        assert is_legal(scene, order)


@each_scene
def test_a_plan_out_of_order_breaks_what_a_step_waits_for(scene):
    for seed in range(20):
        plan = make_plan(scene, "out_of_order", np.random.default_rng(seed))
        steps = [act.step for act in plan.acts]
        assert sorted(steps) == sorted(set(scene.steps) - set(scene.optional))
        assert steps != [step for step in scene.steps if step in steps]
        if scene.waits:
            assert not is_legal(scene, steps)
            assert any(
                steps.index(first) > steps.index(step)
                for step, firsts in scene.waits.items()
                for first in firsts
                if {step, first} <= set(steps)
            )


@each_scene
@pytest.mark.parametrize("kind", KINDS)
def test_plans_that_are_wrong_say_where(scene, kind):
    for seed in range(10):
        plan = make_plan(scene, kind, np.random.default_rng(seed))
        assert (plan.wrong is None) == (kind in ("usual", "free"))
        assert {act.step for act in plan.acts} <= {*scene.steps, *scene.spares}
        assert [not act.works for act in plan.acts].count(True) == (kind == "ineffective")


@each_scene_patiently
def test_one_seed_gives_the_same_pictures(scene):
    plan = make_plan(scene, "extra", np.random.default_rng(1))
    acts = [(act.step, act.works) for act in plan.acts]
    pictures = last_pictures(scene, acts)
    assert pictures.shape == (scene.height * len(scene.cameras), scene.width, 3)
    np.testing.assert_array_equal(pictures, last_pictures(scene, acts))


@each_scene_patiently
def test_an_effect_is_seen_where_it_is_and_not_where_it_is_absent(scene):
    for number, step in enumerate(scene.steps):
        before = [(earlier, True) for earlier in scene.steps[:number]]
        with_effect = last_pictures(scene, [*before, (step, True)]).astype(int)
        without = last_pictures(scene, [*before, (step, False)]).astype(int)
        changed = np.abs(with_effect - without).max(axis=-1) > SEEN
        assert changed.sum() >= PIXELS, step
