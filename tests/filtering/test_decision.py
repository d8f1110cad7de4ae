"""Cut and groups of the default score, law by law."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.judging.norm.cut import SMALLEST_CUT, cut_of, decide

losses_of = st.lists(st.floats(0, 30), min_size=3, max_size=12)


def flagged(losses, groups="auto", left_out=None):
    natures = np.zeros(len(losses), dtype=bool) if left_out is None else np.array(left_out)
    return decide(np.array(losses, dtype=float), natures, groups)[1].flagged.tolist()


@given(losses=losses_of, groups=st.sampled_from(["auto", "1", "2", "3"]), seed=st.integers(0, 99))
@settings(deadline=None)
def test_groups_are_numbered_without_gaps_and_the_threshold_separates(losses, groups, seed):
    natures = np.random.default_rng(seed).random(len(losses)) < 0.5
    weights, grouping = decide(np.array(losses), natures, groups)
    assert set(grouping.groups) == set(range(grouping.count))
    assert grouping.count <= (3 if groups == "auto" else int(groups))
    assert (weights[grouping.flagged] <= grouping.threshold).all()
    assert (weights[~grouping.flagged] >= grouping.threshold).all()
    kept, out = (np.array(losses)[mask] for mask in (~grouping.flagged, grouping.flagged))
    assert len(kept)
    assert not len(out) or kept.max() < out.min()


@given(losses=st.lists(st.floats(0, SMALLEST_CUT), min_size=3, max_size=12))
@settings(deadline=None)
def test_variety_is_never_flagged(losses):
    assert not any(flagged(losses))


def test_nobody_stands_out_where_all_are_alike():
    assert not any(flagged([9.0] * 5))


def test_gross_mistakes_do_not_hide_a_small_one():
    assert flagged([0.0] * 10 + [3.65, 11.3, 10.9, 9.2]) == [False] * 10 + [True] * 4


def test_where_the_usual_ones_vary_a_small_loss_is_variety():
    varied = [0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 0.2, 1.2, 2.2]
    assert flagged([*varied, 3.65, 25.0, 30.0]) == [False] * 11 + [True] * 2
    assert cut_of(np.array([*varied, 3.65, 25.0, 30.0])) > 3.65


@pytest.mark.parametrize("groups", ["auto", "3"])
def test_what_is_out_of_order_comes_before_what_is_left_out(groups):
    losses = [0.0] * 6 + [2.7] * 4 + [3.1, 6.0]
    found = decide(np.array(losses), np.arange(12) >= 10, groups)[1]
    assert found.groups.tolist() == [0] * 6 + [1] * 4 + [2] * 2
    assert found.names == ("kept", "out of order", "steps left out")


def test_mistakes_of_one_nature_are_one_group_unless_three_are_told():
    losses = np.array([0.0] * 6 + [3.0, 3.1, 9.0, 9.1])
    left_out = np.ones(10, dtype=bool)
    assert decide(losses, left_out, "auto")[1].groups.tolist() == [0] * 6 + [1] * 4
    told = decide(losses, left_out, "3")[1].groups
    assert told.tolist() == [0] * 6 + [1] * 2 + [2] * 2
    assert decide(losses, left_out, "auto")[1].names == ("kept", "steps left out")
    assert decide(losses, left_out, "3")[1].names == ()


def test_told_one_group_flags_nothing_and_told_two_finds_two():
    losses = [0.0] * 5 + [1.0]
    assert flagged(losses) == [False] * 6
    assert flagged(losses, "2") == [False] * 5 + [True]
    assert flagged([0.0] * 5 + [9.0], "1") == [False] * 6
