"""The filter works on any pool of step lists: whatever is done, however often, by however many."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from filtering.judging.config import JudgingConfig
from filtering.judging.evidence import Evidence
from filtering.judging.judges import JUDGES
from filtering.judging.norm.norm_score import score_steps
from filtering.judging.norm.steps import StepList, count_steps
from filtering.judging.thresholds import probability_incorrect
from teasim.pool import Span

RULE = JudgingConfig()
ORDERS = st.lists(st.lists(st.integers(0, 5), min_size=1, max_size=8), min_size=3, max_size=8)
"""Repeated sub-tasks, demonstrations of one segment, sub-tasks that nobody does."""


def evidence(orders: list[list[int]], n_subtasks: int = 6) -> Evidence:
    names = tuple(f"step_{k}" for k in range(n_subtasks))
    spans = tuple(
        tuple(Span(names[label], 7 * n, 7 * n + 5) for n, label in enumerate(order))
        for order in orders
    )
    return Evidence(names, spans, [np.eye(n_subtasks)[order] for order in orders])


@pytest.mark.parametrize("name", JUDGES)
@given(orders=ORDERS, seed=st.integers(0, 9))
@settings(max_examples=3, deadline=None)
def test_every_score_judges_every_pool(name: str, orders: list[list[int]], seed: int) -> None:
    judgement = JUDGES[name](evidence(orders), RULE)
    for values in (judgement.losses, judgement.weights, judgement.trust):
        assert values.shape == (len(orders),)
        assert np.isfinite(values).all()
    assert ((judgement.weights >= 0) & (judgement.weights <= 1)).all()
    assert np.isfinite(probability_incorrect(judgement.losses)).all()
    flagged = judgement.grouping.flagged
    assert (judgement.weights[flagged] < judgement.grouping.threshold + 1e-12).all()
    for demo in np.flatnonzero(flagged):
        assert all(np.isfinite(item.surprise) for item in judgement.findings[demo])
    order = np.random.default_rng(seed).permutation(len(orders))
    permuted = JUDGES[name](evidence([orders[k] for k in order]), RULE)
    assert permuted.losses == pytest.approx(judgement.losses[order], abs=1e-4)


@pytest.mark.parametrize("name", JUDGES)
@pytest.mark.parametrize("n_subtasks", [1, 2, 30])
def test_other_numbers_of_sub_tasks(name: str, n_subtasks: int) -> None:
    full = list(range(n_subtasks))
    judgement = JUDGES[name](evidence([full] * 5, n_subtasks), RULE)
    assert not judgement.grouping.flagged.any()
    if n_subtasks > 1:
        judgement = JUDGES[name](evidence([full] * 6 + [full[:-1]], n_subtasks), RULE)
        assert np.flatnonzero(judgement.grouping.flagged).tolist() == [6]


@pytest.mark.parametrize("name", JUDGES)
@pytest.mark.parametrize("usual", [1, 2])
def test_what_two_of_three_or_four_share_is_not_found(name: str, usual: int) -> None:
    """The law behind `caution`."""
    pool = [[0, 1, 2, 3, 4, 5]] * usual + [[0, 1, 2, 3, 5]] * 2
    rule = JudgingConfig(decision="clusters")
    assert not JUDGES[name](evidence(pool), rule).grouping.flagged[usual:].any()


def test_thousands_of_demonstrations_are_scored() -> None:
    """scripts/check_solvers.py does it with 10,000."""
    usual, short = (0, 1, 2, 3, 4, 5, 6), (0, 1, 2, 4, 5, 6)
    demos = [
        StepList(order, (10,) * len(order))
        for order in (short if k % 10 == 0 else usual for k in range(3_000))
    ]
    losses = score_steps(count_steps(demos, 7)).losses
    assert losses[::10].min() > 2 > losses[1::10].max()
