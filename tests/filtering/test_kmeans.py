from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.judging.kmeans import clusters, kmeans

values_of = st.lists(st.integers(-20, 20), min_size=1, max_size=10)


@given(values=values_of, count=st.integers(1, 3))
@settings(deadline=None)
def test_clusters_are_in_order_and_share_nothing(values, count):
    found = clusters(np.array(values, dtype=float), count)
    assert len(found) == min(count, len(set(values)))
    assert sorted(values) == sorted(np.concatenate(found).tolist())
    for lower, upper in pairwise(found):
        assert lower.max() < upper.min()


@given(values=values_of)
@settings(deadline=None)
def test_two_clusters_are_the_best_split(values):
    def within(parts):
        return sum(float(((part - part.mean()) ** 2).sum()) for part in parts if len(part))

    def split(edge):
        return [np.array([v for v in values if (v <= edge) == low]) for low in (True, False)]

    best = min(within(split(edge)) for edge in values)
    assert within(clusters(np.array(values, dtype=float), 2)) == pytest.approx(best)


@given(values=values_of, shift=st.integers(-9, 9), scale=st.integers(1, 5))
@settings(deadline=None)
def test_shift_and_scale_change_no_cluster(values, shift, scale):
    moved = scale * np.array(values, dtype=float) + shift
    assert (kmeans(moved, 2) == kmeans(np.array(values, dtype=float), 2)).all()
