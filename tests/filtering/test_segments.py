from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.segmentation.segments import Segmentation, decode, spans_of
from teasim.pool import Span
from teasim.pool.types import runs


def certain(labels: list[int], n_labels: int = 3, sure: float = 0.8) -> np.ndarray:
    """Posteriors that favour these labels."""
    posteriors = np.full((len(labels), n_labels), (1 - sure) / (n_labels - 1))
    posteriors[np.arange(len(labels)), labels] = sure
    return posteriors


def test_runs():
    assert runs(np.array([2, 2, 0, 2])) == [(2, 0, 2), (0, 2, 3), (2, 3, 4)]
    assert runs(np.array([], dtype=int)) == []


@given(st.lists(st.integers(0, 2), min_size=1, max_size=40))
def test_without_a_least_length_each_frame_gets_its_most_probable_label(labels):
    assert decode(certain(labels)).tolist() == labels


shortest_of = st.lists(st.integers(1, 4), min_size=3, max_size=3)


@given(st.lists(st.integers(0, 2), min_size=1, max_size=40), shortest_of)
def test_no_run_is_shorter_than_its_least_length_unless_it_is_the_only_one(labels, shortest):
    found = runs(decode(certain(labels), shortest))
    assert len(found) == 1 or all(run.length >= shortest[run.label] for run in found)


@given(st.integers(1, 7), shortest_of, st.integers(0, 10_000))
@settings(deadline=None)
def test_no_labelling_with_long_enough_runs_is_more_probable(frames, shortest, seed):
    posteriors = np.random.default_rng(seed).dirichlet([0.5] * 3, frames)

    def value(labels):
        return float(np.log(np.maximum(posteriors[np.arange(frames), labels], 1e-12)).sum())

    able = [
        value(labels)
        for labels in product(range(3), repeat=frames)
        if all(run.length >= shortest[run.label] for run in runs(np.array(labels)))
    ]
    found = decode(posteriors, shortest)
    if able:
        assert value(found) == pytest.approx(max(able))
    else:
        assert set(found) == {int(np.log(np.maximum(posteriors, 1e-12)).sum(axis=0).argmax())}


def test_a_short_run_goes_to_the_neighbour_that_explains_it_better():
    posteriors = certain([0, 0, 0, 1, 2, 2, 2])
    posteriors[3] = [0.3, 0.5, 0.2]
    assert decode(posteriors, [2, 2, 2]).tolist() == [0, 0, 0, 0, 2, 2, 2]
    posteriors[3] = [0.2, 0.5, 0.3]
    assert decode(posteriors, [2, 2, 2]).tolist() == [0, 0, 0, 2, 2, 2, 2]


def test_spans_leave_out_frames_of_no_subtask():
    labels = np.array([2, 0, 0, 2, 1])
    assert spans_of(labels, certain([2, 0, 0, 2, 1]), ("pour", "stir")) == (
        Span("pour", 1, 3),
        Span("stir", 4, 5),
    )


@pytest.mark.parametrize(("second", "name"), [(0.3, "stir"), (0.05, "pour")])
def test_a_video_of_no_subtask_is_one_segment_of_the_likeliest(second, name):
    posteriors = np.tile([0.1, second, 0.9 - second], (4, 1))
    spans = spans_of(posteriors.argmax(axis=1), posteriors, ("pour", "stir"))
    assert spans == (Span(name, 0, 4),)


def test_the_reliability_of_a_segment_is_the_mean_posterior_of_its_label():
    posteriors = certain([0, 0, 1, 1], sure=0.8)
    posteriors[1] = [0.6, 0.3, 0.1]
    spans = ((Span("a", 0, 2), Span("b", 2, 4)),)
    found = Segmentation(("a", "b", "c"), spans, (posteriors,))
    assert found.reliability()[0] == pytest.approx([0.7, 0.8])
    assert Segmentation(("a", "b", "c"), spans).reliability() is None
