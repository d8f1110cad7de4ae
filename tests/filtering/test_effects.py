"""A segment that changes less than usual is noticed; usual segments cost nothing."""

import shutil
from collections.abc import Sequence

import numpy as np
import pyarrow as pa
import pytest

from filtering import DemoFilter, FilterConfig
from filtering.cli import basis
from filtering.effects.logged import ROBOT, change_surprises
from filtering.effects.rests import changes, look_at_rests, rest_features, rest_moments
from filtering.effects.surprise import effect_surprises
from filtering.vision.frame_features import FrameSource, frame_features
from teasim.common.workers import IN_PROCESS
from teasim.constants import SUBTASKS
from teasim.pool import Pool, Span
from teasim.pool.lerobot.layout import ENVIRONMENT_STATE
from tests.toy_pool import SEQ_1, make_toy_pool, rewrite_table

FEATURES = 40
INVISIBLE = "stir"
TRACES = {
    name: np.random.default_rng(number).normal(size=FEATURES) * (name != INVISIBLE)
    for number, name in enumerate(SEQ_1)
} | {"turn_off_oven": -np.random.default_rng(0).normal(size=FEATURES)}


def toy_rests(
    names: Sequence[str], rng: np.random.Generator, without: Sequence[int] = ()
) -> np.ndarray:
    """Rests (q + 1, F) of a video with a look of its own; steps `without` leave nothing behind."""
    moved = [TRACES[name] * (step not in without) for step, name in enumerate(names)]
    shown = np.vstack([np.zeros(FEATURES), np.cumsum(moved, axis=0)])
    return rng.normal(size=FEATURES) * 3 + shown + rng.normal(scale=0.15, size=shown.shape)


def toy_changes(demos: int, bad: int, seed: int, step: int) -> list[np.ndarray]:
    """Changes of `demos` demonstrations; in the last `bad` ones a step is ineffective."""
    rng = np.random.default_rng(seed)
    return [
        changes(toy_rests(SEQ_1, rng, [step] if demo >= demos - bad else []))
        for demo in range(demos)
    ]


def worst(pool: list[np.ndarray]) -> np.ndarray:
    labels = [list(range(len(SEQ_1)))] * len(pool)
    return np.array([nats.max() for nats in effect_surprises(pool, labels)])


@pytest.mark.parametrize("step", [0, 2, 5])
@pytest.mark.parametrize(("demos", "bad"), [(4, 1), (12, 4), (50, 15)])
def test_a_minority_without_the_effect_is_noticed_without_labels(demos, bad, step):
    nats = worst(toy_changes(demos, bad, 3, step))
    assert nats[demos - bad :].min() > 2
    assert nats[: demos - bad].max() < 1


@pytest.mark.parametrize("demos", [3, 12, 30])
def test_usual_segments_and_invisible_effects_cost_nothing(demos):
    assert worst(toy_changes(demos, 0, 4, 0)).max() < 1
    assert worst(toy_changes(demos, 1, 4, SEQ_1.index(INVISIBLE))).max() < 1


def test_surprises_follow_the_demonstrations():
    pool = toy_changes(6, 1, 8, 2)
    labels = [list(range(len(SEQ_1)))] * 6
    usual = effect_surprises(pool, labels)
    for nats, mirrored in zip(usual, effect_surprises(pool[::-1], labels)[::-1], strict=True):
        np.testing.assert_allclose(nats, mirrored, atol=1e-6)


def test_what_only_one_demonstration_or_none_shows_costs_nothing():
    rng = np.random.default_rng(0)
    pool = [rng.normal(size=(q, 5)) for q in (1, 2, 1)]
    surprises = effect_surprises(pool, [[7], [7, 3], [9]])
    np.testing.assert_array_equal(np.concatenate(surprises), 0.0)
    still = effect_surprises([np.zeros((2, 5))] * 4, [[0, 1]] * 4)
    np.testing.assert_array_equal(np.concatenate(still), 0.0)


def test_a_step_is_compared_with_the_same_one_after_the_same_steps():
    """Where nobody else did it after these, its smaller effect accuses nobody."""
    pool = toy_changes(demos=8, bad=1, seed=0, step=2)
    bad = int(worst(pool).argmax())
    labels = [list(range(len(pool[0])))] * 8
    labels[bad] = [0, 3, 2, 1, *labels[0][4:]]
    assert effect_surprises(pool, labels)[bad][2] == 0
    assert worst(pool)[bad] > 2


def test_a_video_is_at_rest_at_the_borders_of_its_segments():
    frames = np.arange(1, 60, 2)
    spans = (Span("a", 4, 20), Span("b", 24, 41), Span("c", 41, 60))
    chosen = rest_moments(frames, spans, 10.0)
    assert [frames[c].tolist() for c in chosen] == [[1, 3, 5], [19, 21, 23], [39, 41, 43], [57, 59]]
    assert [len(c) for c in rest_moments(np.array([30]), spans, 10.0)] == [1, 1, 1, 1]


def test_looking_at_rests_alone_sees_the_same(toy_pool: Pool):
    episodes, source = toy_pool.episodes[:1], FrameSource(("cup",))
    segments = [episode.spans() for episode in episodes]
    seen = look_at_rests(episodes, segments, toy_pool.fps, source, workers=IN_PROCESS)
    moments = frame_features(episodes, toy_pool.fps, source, workers=IN_PROCESS)
    for rests, features, episode in zip(seen, moments, episodes, strict=True):
        full = rest_features(features, episode.length, episode.spans(), toy_pool.fps)
        np.testing.assert_allclose(rests, full, atol=1e-4)
        assert len(rests) == len(episode.spans()) + 1


def without_effect(table: pa.Table, subtask: str) -> pa.Table:
    """A joint log that never says that a sub-task is done."""
    rows = np.array(table.column(ENVIRONMENT_STATE).to_pylist())
    rows[:, SUBTASKS.index(subtask)] = 0.0
    field = table.schema.field(ENVIRONMENT_STATE)
    place = table.schema.get_field_index(ENVIRONMENT_STATE)
    return table.set_column(place, field, pa.array(rows.tolist(), field.type))


@pytest.mark.parametrize("share", [0.0, 0.4, 0.6])
@pytest.mark.parametrize("demos", [6, 40])
def test_a_log_shows_what_is_lacking_in_part(demos, share) -> None:
    rng = np.random.default_rng(5)
    usual = rng.normal(size=(3, 6)) * [1, 1, 1, 1, 0, 0]  # two numbers never change
    pool = [usual + rng.normal(scale=0.01, size=usual.shape) for _ in range(demos)]
    pool[2][1] *= share
    nats = change_surprises(pool, [[0, 1, 2]] * demos)
    assert nats[2][1] > (1 if demos > 6 else 0)
    nats[2][1] = 0
    assert max(map(max, nats)) == 0
    assert [*map(len, change_surprises(pool[:2], [[0, 1, 2]] * 2))] == [3, 3]  # too few to compare


def test_numbers_of_the_robot_are_known_by_their_names() -> None:
    robot = ("right_hand_x", "knob_in_left_hand_x", "robot0_eef_pos_0", "gripper_to_can_pos_x")
    things = ("cube_x", "kettle_handle_x", "knob_angle")
    assert all(ROBOT.search(name) for name in robot)
    assert not any(ROBOT.search(name) for name in things)


def test_without_pictures_the_log_of_the_environment_shows_what_has_no_effect(tmp_path) -> None:
    pool = make_toy_pool(tmp_path / "toy", [SEQ_1] * 8, cameras=())
    clean = DemoFilter(FilterConfig()).fit(pool)
    assert not clean.flagged_.any()
    log = sorted(pool.root.glob("data/*/*.parquet"))[5]
    rewrite_table(log, lambda table: without_effect(table, "add_milk"))
    shutil.rmtree(pool.root / "teasim")  # its check sums are those of the log before
    damaged = Pool.open(pool.root)
    fitted = DemoFilter(FilterConfig()).fit(damaged)
    assert np.flatnonzero(fitted.flagged_).tolist() == [5]
    assert "'add_milk' was carried out" in fitted.reasons_[5]
    assert basis(fitted) == (
        "Judged by the logged sub-tasks, and by what they change in the logged state of the "
        "environment."
    )
    blind = DemoFilter(FilterConfig(effects=False)).fit(damaged)
    assert not blind.flagged_.any()
    assert basis(blind) == "Judged by the logged sub-tasks."
