"""Effects are read whatever the order was; only a missing one costs."""

import json
from collections.abc import Sequence

import numpy as np
import pytest

from filtering.effects.checkpoint import load_effects, save_effects
from filtering.effects.reader import (
    Effect,
    EffectReader,
    effect_states,
    find_effects,
    fit_effects,
)
from filtering.effects.rests import changes, look_at_rests, rest_features, rest_moments
from filtering.effects.surprise import effect_surprises
from filtering.vision.frame_features import FrameSource, frame_features
from teasim.common.errors import CheckpointError, ConfigError
from teasim.pool import Pool, Span
from tests.toy_pool import SEQ_1, SEQ_2

SOURCE = FrameSource(("left", "cup"))
FEATURES = 40
INVISIBLE = "stir"
OVEN = Effect("turn_on_oven", "turn_off_oven")
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


def shuffled(rng: np.random.Generator) -> tuple[str, ...]:
    middle = rng.permutation(SEQ_1[1:4]).tolist()
    return (SEQ_1[0], *middle, *SEQ_1[4:]) if rng.random() < 0.5 else (*SEQ_2,)


@pytest.fixture(scope="module")
def labelled() -> tuple[list[np.ndarray], list[tuple[str, ...]]]:
    rng = np.random.default_rng(1)
    names = [shuffled(rng) for _ in range(8)]
    return [toy_rests(done, rng) for done in names], names


@pytest.fixture(scope="module")
def reader(labelled) -> EffectReader:
    return fit_effects(*labelled, SOURCE)


def test_what_is_undone_is_one_effect(labelled, reader):
    assert OVEN in reader.effects
    alone = {effect.subtask for effect in reader.effects if effect.undone_by is None}
    assert alone == set(SEQ_1) - {"turn_on_oven", "turn_off_oven"}
    assert find_effects(*labelled) == find_effects(labelled[0][::-1], labelled[1][::-1])


def test_states_follow_the_steps():
    effects = (OVEN, Effect("add_milk", None))
    done = ("add_milk", "turn_on_oven", "add_sugar", "turn_off_oven", "turn_on_oven")
    expected = [[0, 0], [0, 1], [1, 1], [1, 1], [0, 1], [1, 1]]
    np.testing.assert_array_equal(effect_states(effects, done), expected)


def test_effects_are_read_in_orders_never_shown(reader):
    done = ("add_water", "add_tea_bag", "turn_on_oven", "add_milk", "turn_off_oven", "add_sugar")
    said = reader.read(toy_rests(done, np.random.default_rng(9)))
    visible = [n for n, effect in enumerate(reader.effects) if effect.subtask != INVISIBLE]
    truth = effect_states(reader.effects, done)[1:]
    np.testing.assert_array_equal((said > 0.5)[:, visible], truth[:, visible] > 0.5)
    assert said.min() >= 0
    assert said.max() <= 1


def test_what_cannot_be_seen_is_not_claimed(reader):
    errors = {e.subtask: error for e, error in zip(reader.effects, reader.errors, strict=True)}
    unseen = errors.pop(INVISIBLE)
    assert unseen > 2 * max(errors.values())
    reliability = reader.reliability()
    assert reliability.pop(INVISIBLE) < min(reliability.values()) > 0.95


@pytest.mark.parametrize("step", [n for n, name in enumerate(SEQ_1) if name != INVISIBLE])
def test_the_reader_notices_what_came_of_nothing(reader, step):
    surprises = reader.surprises(toy_rests(SEQ_1, np.random.default_rng(5), [step]), SEQ_1)
    usual = reader.surprises(toy_rests(SEQ_1, np.random.default_rng(5)), SEQ_1)
    assert surprises[step] > 3
    visible = [n for n, name in enumerate(SEQ_1) if name != INVISIBLE]
    assert usual[visible].max() < 0.1


def test_learning_does_not_depend_on_the_order_of_demonstrations(labelled, reader):
    rests, names = labelled
    other = fit_effects(rests[::-1], names[::-1], SOURCE)
    np.testing.assert_allclose(other.weights, reader.weights, atol=1e-5)
    again = fit_effects(rests, names, SOURCE)
    np.testing.assert_array_equal(again.weights, reader.weights)


def test_too_few_demonstrations_are_refused(labelled, reader):
    with pytest.raises(ConfigError) as caught:
        fit_effects(labelled[0][:2], labelled[1][:2], SOURCE)
    assert str(caught.value) == (
        "Effects are learned from 3 labelled demonstrations or more, not 2."
    )
    with pytest.raises(ConfigError) as caught:
        reader.read(np.zeros((3, 7)))
    assert str(caught.value) == (
        "The video has 7 features per rest; the effects were learned from 40."
    )


def toy_changes(demos: int, bad: int, seed: int, step: int) -> list[np.ndarray]:
    """Changes of `demos` demonstrations; in the last `bad` ones, nothing comes of a step."""
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


def test_surprises_follow_the_demonstrations(labelled):
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
    seen = look_at_rests(episodes, segments, toy_pool.fps, source, jobs=1)
    moments = frame_features(episodes, toy_pool.fps, source, jobs=1)
    for rests, features, episode in zip(seen, moments, episodes, strict=True):
        full = rest_features(features, episode.length, episode.spans(), toy_pool.fps)
        np.testing.assert_allclose(rests, full, atol=1e-4)
        assert len(rests) == len(episode.spans()) + 1


def test_a_saved_reader_says_the_same(reader, tmp_path):
    save_effects(reader, tmp_path)
    loaded = load_effects(tmp_path)
    rests = toy_rests(SEQ_1, np.random.default_rng(2))
    np.testing.assert_array_equal(loaded.read(rests), reader.read(rests))
    assert loaded.effects == reader.effects
    assert loaded.source == reader.source
    assert loaded.reliability() == reader.reliability()


@pytest.mark.parametrize(
    "fields",
    [
        {"effects": [{"subtask": "pour"}]},
        {"effects": []},
        {"effects": None},
        {"errors": [0.1]},
        {"certainties": "many"},
        {"source": {"cameras": [], "rate": 5.0}},
        {"source": None},
    ],
)
def test_a_description_of_other_weights_is_refused(reader, tmp_path, fields):
    save_effects(reader, tmp_path)
    path = tmp_path / "effects.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))
    with pytest.raises(CheckpointError) as caught:
        load_effects(tmp_path)
    assert str(caught.value) == f"'{path}' does not describe the weights beside it; fit again."


def test_no_reader_and_other_features_are_refused(reader, tmp_path):
    with pytest.raises(CheckpointError) as caught:
        load_effects(tmp_path)
    assert str(caught.value) == (
        f"'{tmp_path}' holds no effect reader: effects.json cannot be read."
    )
    save_effects(reader, tmp_path)
    path = tmp_path / "effects.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"features": ["vgg16", "0"]}))
    with pytest.raises(CheckpointError) as caught:
        load_effects(tmp_path)
    assert str(caught.value) == (
        f"'{path}' was fitted to other features of a frame than this program computes; fit again."
    )
