import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from filtering.thresholds import group_weights
from teasim.errors import ConfigError

weight_lists = st.lists(st.floats(0.0, 1.0), min_size=3, max_size=20)


@given(weight_lists, st.sampled_from(["auto", "1", "2", "3"]))
def test_groups_are_ordered_and_the_threshold_separates(values: list[float], groups: str) -> None:
    weights = np.array(values)
    found = group_weights(weights, groups)
    assert 0.0 <= found.threshold <= 1.0
    assert np.array_equal(found.flagged, weights < found.threshold)
    order = np.argsort(-weights, kind="stable")
    assert (np.diff(found.groups[order]) >= 0).all()
    assert set(found.groups) == set(range(found.count))


@given(weight_lists, st.sampled_from(["auto", "2", "3"]))
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
