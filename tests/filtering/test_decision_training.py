"""Fitting the learned decision: drawn pools in files, learning, calibration, the checkpoint."""

import numpy as np
import pytest

from filtering.judging.decision import drawing
from filtering.judging.decision.calibration import calibration
from filtering.judging.decision.description import describe
from filtering.judging.decision.drawing import draw_lesson, draw_lessons, read_lessons
from filtering.judging.decision.model import load_model, save_model
from filtering.judging.decision.observed import canonical
from filtering.judging.decision.prior.mistakes import omit
from filtering.judging.decision.prior.pools import draw_pool
from filtering.judging.decision.prior.tasks import draw_task
from filtering.judging.decision.training import LearningConfig, learn
from filtering.vision.determinism import one_thread

SMALL = LearningConfig(networks=1, epochs=2, batch=8, held_back=0.25)


@pytest.fixture(scope="module")
def lessons():
    return [draw_lesson(3, number) for number in range(40)]


def test_lessons_are_kept_in_files_and_a_draw_is_resumed(tmp_path, monkeypatch, lessons):
    monkeypatch.setattr(drawing, "CHUNK", 4)
    assert list(draw_lessons(tmp_path, 3, 4)) == [4]
    before = (tmp_path / "seed3_000000.npz").stat().st_mtime_ns
    assert list(draw_lessons(tmp_path, 3, 8)) == [4, 8]
    assert (tmp_path / "seed3_000000.npz").stat().st_mtime_ns == before
    for found, wanted in zip(read_lessons(tmp_path, 3, 6), lessons, strict=False):
        for name in ("rows", "pairs", "incorrect", "facts"):
            assert np.array_equal(getattr(found, name), getattr(wanted, name))


def test_the_same_lessons_give_the_same_model_and_the_file_keeps_it(tmp_path, lessons):
    with one_thread():
        first, second = (learn(lessons, SMALL, lambda _: None) for _ in range(2))
    pool = canonical(draw_pool(np.random.default_rng(1)).observed).pool
    found = describe(pool)
    save_model(first, tmp_path)
    loaded = load_model(tmp_path)
    for one, two, three in zip(*(m.logits(found) for m in (first, second, loaded)), strict=True):
        assert np.array_equal(one, two)
        assert np.array_equal(one, three)


def test_learning_lowers_the_loss(lessons):
    said = []
    with one_thread():
        learn(lessons, SMALL, said.append)
    losses = [float(line.rsplit(" ", 1)[1]) for line in said]
    assert losses[-1] < losses[0]


def test_the_calibration_error_is_that_of_the_bins():
    p, truth = np.array([0.1, 0.1, 0.9, 0.9]), np.array([0.0, 1.0, 1.0, 1.0])
    found = calibration(p, truth)
    assert found["ece"] == pytest.approx((2 * 0.4 + 2 * 0.1) / 4)
    assert found["brier"] == pytest.approx((0.01 + 0.81 + 0.01 + 0.01) / 4)
    assert found["brier of the base rate"] == pytest.approx(0.75 * 0.25)
    assert found["diagram"] == [(2, pytest.approx(0.1), 0.5), (2, pytest.approx(0.9), 1.0)]


def test_a_mistake_never_leaves_nothing():
    rng = np.random.default_rng(0)
    task = draw_task(rng, exact=True)
    orders = [omit(rng, task, [0, 1, 0, 1]) for _ in range(50)]
    assert None in orders
    assert [] not in orders
