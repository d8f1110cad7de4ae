from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.judging.thresholds import METHODS, group_weights, probability_incorrect
from teasim.common.errors import ConfigError

weight_lists = st.lists(st.floats(0.0, 1.0), min_size=3, max_size=20)


@given(weight_lists, st.sampled_from(["auto", "1", "2", "3"]))
@settings(deadline=None)
def test_groups_are_ordered_and_the_threshold_separates(values: list[float], groups: str) -> None:
    weights = np.array(values)
    found = group_weights(weights, groups)
    assert 0.0 <= found.threshold <= 1.0
    assert np.array_equal(found.flagged, weights < found.threshold)
    order = np.argsort(-weights, kind="stable")
    assert (np.diff(found.groups[order]) >= 0).all()
    assert set(found.groups) == set(range(found.count))


@given(weight_lists, st.sampled_from(["auto", "2", "3"]))
@settings(deadline=None)
def test_equal_weights_share_a_group(values: list[float], groups: str) -> None:
    weights = np.array([*values, *values])
    found = group_weights(weights, groups).groups
    assert np.array_equal(found[: len(values)], found[len(values) :])


def test_two_groups_are_cut_at_the_mid_point_of_their_means() -> None:
    found = group_weights(np.array([1.0, 0.9, 0.2, 0.1]))
    assert found.groups.tolist() == [0, 0, 1, 1]
    assert found.threshold == pytest.approx((0.95 + 0.15) / 2)


def test_a_clean_pool_is_one_group() -> None:
    found = group_weights(np.array([1.0, 1.0, 0.9, 0.8, 0.7]))
    assert found.count == 1
    assert not found.flagged.any()
    assert found.threshold == 0.0


def test_three_groups_are_found_when_they_are_there() -> None:
    found = group_weights(np.array([1.0, 1.0, 1.0, 0.5, 0.5, 0.48, 0.01, 0.0]))
    assert found.groups.tolist() == [0, 0, 0, 1, 1, 1, 2, 2]
    assert group_weights(np.array([1.0, 0.5, 0.0]), "3").groups.tolist() == [0, 1, 2]


def test_asked_for_groups_are_never_more_than_different_weights() -> None:
    assert group_weights(np.ones(5), "3").count == 1


@pytest.mark.parametrize(
    ("groups", "message"),
    [
        ("4", "Unknown number of groups '4'; choose auto, 1, 2, 3."),
        (
            "3",
            "3 groups were asked for but there are only 2 demonstrations; "
            "choose auto or at most 2.",
        ),
    ],
)
def test_impossible_numbers_of_groups_are_refused(groups: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        group_weights(np.array([1.0, 0.0]), groups)
    assert str(caught.value) == message


@given(st.lists(st.integers(0, 30), min_size=3, max_size=9), st.sampled_from([2, 3]))
@settings(deadline=None)
def test_k_means_is_the_best_of_all_splits(values: list[int], count: int) -> None:
    weights = np.array(values) / 30
    ordered = sorted(set(weights))

    def within(groups: np.ndarray) -> float:
        parts = [weights[groups == group] for group in set(groups.tolist())]
        return float(sum(((part - part.mean()) ** 2).sum() for part in parts))

    found = within(group_weights(weights, str(count)).groups)
    for edges in combinations(ordered[1:], min(count, len(ordered)) - 1):
        assert found <= within(np.searchsorted(edges, weights, side="right")) + 1e-12


BIMODAL = np.array([0.95, 1.0, 0.9, 0.92, 0.97, 0.99, 0.05, 0.1, 0.0])


@pytest.mark.parametrize("groups", ["auto", "2"])
@pytest.mark.parametrize("method", METHODS)
def test_every_method_cuts_between_two_clear_groups(method: str, groups: str) -> None:
    found = group_weights(BIMODAL, groups, method)
    assert found.groups.tolist() == [0] * 6 + [1] * 3
    assert 0.3 < found.threshold < 0.7


@pytest.mark.parametrize("method", METHODS)
@given(values=weight_lists, groups=st.sampled_from(["auto", "1", "2", "3"]))
@settings(max_examples=10, deadline=None)
def test_every_method_orders_its_groups_and_ignores_the_order_of_the_pool(
    method: str, values: list[float], groups: str
) -> None:
    weights = np.array(values)
    found = group_weights(weights, groups, method)
    assert np.array_equal(found.flagged, weights < found.threshold)
    assert set(found.groups) == set(range(found.count))
    backwards = group_weights(weights[::-1], groups, method)
    assert backwards.groups.tolist() == found.groups[::-1].tolist()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("groups", ["auto", "2", "3"])
def test_rounding_makes_no_groups(method: str, groups: str) -> None:
    weights = np.array([0.5, 0.5, 0.5 + 1e-12, 1e-200 + 0.5])
    assert not group_weights(weights, groups, method).flagged.any()


@pytest.mark.parametrize("method", METHODS)
def test_no_method_flags_in_a_clean_pool(method: str) -> None:
    for weights in (np.ones(5), np.array([1.0, 1.0, 0.9, 0.8, 0.7])):
        assert not group_weights(weights, "auto", method).flagged.any()


def test_unknown_methods_are_refused() -> None:
    with pytest.raises(ConfigError) as caught:
        group_weights(BIMODAL, "2", "luck")
    assert str(caught.value) == "Unknown threshold 'luck'; choose kmeans, gmm, minibatch."


def test_ten_thousand_weights_are_grouped_in_seconds() -> None:
    weights = np.random.default_rng(0).random(10_000) * 0.3
    weights[::10] += 0.7
    assert group_weights(weights).flagged.sum() == 9_000


@given(st.lists(st.floats(0.0, 40.0), min_size=3, max_size=20))
@settings(max_examples=20, deadline=None)
def test_probabilities_rise_with_the_loss(values: list[float]) -> None:
    losses = np.array(values)
    found = probability_incorrect(losses)
    assert ((found >= 0) & (found <= 1)).all()
    assert (np.diff(found[np.argsort(losses)]) >= -1e-9).all()
    assert probability_incorrect(losses[::-1]) == pytest.approx(found[::-1], abs=1e-9)


def test_probabilities_are_clear_where_the_pool_is() -> None:
    clear = probability_incorrect(np.array([0.0] * 8 + [9.0, 12.0]))
    assert clear[:8].max() < 0.05
    assert clear[8:].min() > 0.95
    assert probability_incorrect(np.zeros(6)).tolist() == [0.0] * 6
    assert probability_incorrect(np.linspace(0, 0.5, 10)).max() < 0.5
