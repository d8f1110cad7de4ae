"""Videos made of a few things in any order give these things back, and as many as there are."""

import numpy as np
import pytest

from filtering.segmentation.unlabelled import discovery
from filtering.segmentation.unlabelled.discovery import (
    MOST_STAGES,
    MOST_SUBTASKS,
    Discovery,
    discover,
    stage_count,
)
from filtering.segmentation.unlabelled.twfinch import partition
from teasim.common.workers import Workers
from teasim.pool.types import runs

FEATURES = 16
SHOWN = 36
"""Moments of a sub-task, on average."""


def made_up(
    orders: list[tuple[int, ...]], *, noise: float = 0.3, drift: float = 0.5, seed: int = 0
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Videos in which sub-task k is a path of its own from rest to rest, fast or slow."""
    rng = np.random.default_rng(seed)
    paths = np.random.default_rng(1).normal(0.0, 1.0, (9, 2, FEATURES))
    videos, truths = [], []
    for order in orders:
        parts, labels = [], []
        for name in order:
            length = int(rng.integers(SHOWN - 4, SHOWN + 5))
            phase = np.linspace(0, np.pi, length)[:, None]
            waves = np.stack([np.sin(phase * (1 + k)) * np.sin(phase) for k in range(2)])
            parts.append((waves * 2 * paths[name][:, None]).sum(axis=0))
            labels += [name] * length
        video = np.concatenate(parts)
        video += drift * rng.normal(size=FEATURES) * np.linspace(-1, 1, len(video))[:, None]
        video += rng.normal(0.0, noise, video.shape)
        videos.append(video - video.mean(axis=0))
        truths.append(np.array(labels))
    return videos, truths


ORDERS = [(0, 1, 2, 3), (0, 2, 1, 3), (1, 0, 3, 2), (0, 1, 3), (2, 0, 1, 3), (0, 1, 2, 3)]


@pytest.fixture(scope="module")
def four() -> tuple[list[np.ndarray], list[np.ndarray], Discovery]:
    videos, truths = made_up(ORDERS)
    return videos, truths, discover(videos)


def test_number_and_labels_are_found(four):
    _, truths, found = four
    assert found.posteriors[0].shape[1] == 4
    pairs = np.stack([np.concatenate(found.labels), np.concatenate(truths)])
    kinds, counts = np.unique(pairs, axis=1, return_counts=True)
    names = {int(kinds[0, i]): int(kinds[1, i]) for i in np.argsort(counts)}
    assert sorted(names.values()) == [0, 1, 2, 3]
    assert np.mean([names[a] == b for a, b in pairs.T.tolist()]) > 0.9
    orders = [tuple(names[run.label] for run in runs(labels)) for labels in found.labels]
    assert orders == ORDERS


def test_posteriors_are_probabilities_that_agree_with_the_labels(four):
    videos, _, found = four
    for video, labels, posteriors in zip(videos, found.labels, found.posteriors, strict=True):
        assert posteriors.shape == (len(video), 4)
        np.testing.assert_allclose(posteriors.sum(axis=1), 1.0, atol=1e-9)
        assert (posteriors.argmax(axis=1) == labels).mean() > 0.9


def test_labels_are_numbered_in_the_usual_order(four):
    _, _, found = four
    places: dict[int, list[float]] = {}
    for labels in found.labels:
        for label in set(labels.tolist()):
            places.setdefault(label, []).append(labels.tolist().index(label) / len(labels))
    means = [np.mean(places[label]) for label in range(4)]
    assert means == sorted(means)


def test_permuting_the_videos_permutes_the_result(four):
    videos, _, found = four
    order = [3, 5, 0, 1, 4, 2]
    permuted = discover([videos[number] for number in order])
    for place, number in enumerate(order):
        np.testing.assert_array_equal(permuted.labels[place], found.labels[number])
        np.testing.assert_allclose(permuted.posteriors[place], found.posteriors[number], atol=1e-6)


def test_the_result_does_not_depend_on_the_number_of_workers(four, monkeypatch):
    monkeypatch.setattr(discovery, "WORTH_WORKERS", 1)
    videos, _, found = four
    for jobs in (2, 3):
        again = discover(videos, workers=Workers(jobs))
        for one, other in zip(found.posteriors, again.posteriors, strict=True):
            np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize(("least", "together"), [(1, 3), (10**9, 1)])
def test_large_pools_try_as_many_numbers_at_once_as_there_are_workers(
    four, monkeypatch, least, together
):
    tried = []

    def run(function, items, *, workers, progress):
        tried.append((list(items), workers.count))
        return [function(item) for item in items]

    monkeypatch.setattr(discovery, "WORTH_WORKERS", least)
    monkeypatch.setattr(discovery.parallel, "run", run)
    discover(four[0], workers=Workers(3))
    numbers = [number for items, _ in tried for number in items]
    assert numbers == list(range(2, 2 + len(numbers)))
    assert {count for _, count in tried} == {together}
    assert max(len(items) for items, _ in tried) == together


def test_more_noise_makes_less_sure(four):
    noisy = discover(made_up(ORDERS, noise=8.0)[0], 4)
    sure, unsure = (
        np.concatenate([video.max(axis=1) for video in one.posteriors]).mean()
        for one in (four[2], noisy)
    )
    assert unsure < sure


def test_as_many_as_asked_for():
    videos, _ = made_up([(0, 1, 2)] * 3)
    for wanted in (1, 2, 3, 5):
        labels = np.concatenate(discover(videos, wanted).labels)
        assert 1 <= len(np.unique(labels)) <= wanted
        assert labels.max() == len(np.unique(labels)) - 1


def test_rests_are_not_what_it_lives_on():
    videos, truths = made_up(ORDERS)
    cut = []
    for video, truth in zip(videos, truths, strict=True):
        edges = [edge for run in runs(truth) for edge in (run.start, run.stop - 1)]
        beside = {edge + step for edge in edges for step in (-1, 0, 1)}
        cut.append(np.delete(video, [m for m in beside if 0 <= m < len(video)], axis=0))
    assert discover(cut).posteriors[0].shape[1] == 4


def test_videos_in_which_nothing_happens_are_one_subtask():
    found = discover([np.zeros((60, 5))] * 4)
    assert all((labels == 0).all() for labels in found.labels)
    assert all((posteriors == 1.0).all() for posteriors in found.posteriors)


@pytest.mark.parametrize("lengths", [(1, 1), (1, 3, 2), (1, 80, 90), (5, 130, 130)])
def test_videos_of_any_length_are_labelled_throughout(lengths):
    rng = np.random.default_rng(0)
    found = discover([rng.normal(size=(length, 4)) for length in lengths])
    assert tuple(map(len, found.labels)) == lengths
    for labels, posteriors in zip(found.labels, found.posteriors, strict=True):
        assert (labels >= 0).all()
        assert labels.max() < posteriors.shape[1]
        np.testing.assert_allclose(posteriors.sum(axis=1), 1.0, atol=1e-9)


def test_the_usual_video_has_room_for_all_stages():
    assert stage_count([370, 400, 350]) == MOST_STAGES
    assert stage_count([36, 36, 36]) == 36 // MOST_SUBTASKS
    assert stage_count([3]) == 1
    assert stage_count([100], subtasks=50) == 2


def test_a_video_is_cut_where_its_looks_change():
    looks = np.eye(4)[np.repeat([0, 1, 2, 0], 10)]
    np.testing.assert_array_equal(
        [run.start for run in runs(partition(looks + 0.01, 4))], [0, 10, 20, 30]
    )


@pytest.mark.parametrize(("moments", "parts"), [(1, 1), (1, 5), (4, 9), (30, 1), (30, 7)])
def test_a_video_has_as_many_parts_as_wanted_or_as_it_has_moments(moments, parts):
    video = np.random.default_rng(0).normal(size=(moments, 3))
    labels = partition(video, parts)
    assert set(labels.tolist()) == set(range(min(moments, parts)))
