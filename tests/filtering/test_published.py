"""The published method: w of equation 3 itself, clustered into as many groups as it is told."""

import numpy as np
import pytest

from filtering.config import FilterConfig
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.published import Published
from filtering.judging.equation3.sequence import transitions
from filtering.judging.equation3.solvers import SOLVERS
from filtering.judging.evidence import Evidence
from filtering.judging.judgement import Judgement
from filtering.judging.judges import by_equation_3
from filtering.judging.thresholds import METHODS
from teasim.common.errors import ConfigError
from teasim.pool import Span

SEQ_1, SEQ_2, SEQ_3 = (0, 1, 2, 3, 4, 5, 6), (0, 2, 3, 1, 4, 5, 6), (0, 1, 2, 3, 5, 6)
NAMES = tuple("abcdefg")


def evidence(orders) -> Evidence:
    """Segments with features of their sub-task and a little noise."""
    rng = np.random.default_rng(0)
    means = rng.normal(size=(7, 12)) / np.sqrt(12)
    spans = tuple(tuple(Span(NAMES[a], n, n + 1) for n, a in enumerate(order)) for order in orders)
    states = [means[list(order)] + 0.05 * rng.normal(size=(len(order), 12)) for order in orders]
    return Evidence(NAMES, spans, states=states)


def judged(orders, **settings) -> Judgement:
    return by_equation_3(evidence(orders), FilterConfig(score="equation3", **settings))


@pytest.mark.parametrize("threshold", METHODS)
@pytest.mark.parametrize("wrong", [SEQ_2, SEQ_3])
def test_w_itself_flags_the_incorrect_ones_by_every_published_threshold(threshold, wrong) -> None:
    pool = [SEQ_1] * 10 + [wrong] * 4
    found = judged(pool, solver="published", threshold=threshold, groups="2")
    rows = transitions(evidence(pool).states, evidence(pool).labels, 7)
    assert found.weights.tolist() == Published().fit(Problem(rows, 0.01), 7).weights_.tolist()
    assert np.flatnonzero(found.grouping.flagged).tolist() == [10, 11, 12, 13]
    assert found.weights.sum() == pytest.approx(7)
    assert all(found.findings[demo] for demo in range(10, 14))


def test_the_threshold_lies_at_the_mid_point_of_the_means() -> None:
    found = judged([SEQ_1] * 10 + [SEQ_3] * 4, solver="published", groups="2")
    kept, flagged = (found.weights[found.grouping.groups == group] for group in (0, 1))
    assert found.grouping.threshold == pytest.approx((kept.mean() + flagged.mean()) / 2)


@pytest.mark.parametrize("solver", SOLVERS)
def test_w_and_leave_one_out_are_options_of_every_solver(solver: str) -> None:
    pool = [SEQ_1] * 7 + [SEQ_3]
    w = judged(pool, solver=solver, judged_by="w")
    other = judged(pool, solver=solver, judged_by="leave-one-out")
    assert w.weights.tolist() == w.trust.tolist()
    assert w.weights.sum() == pytest.approx(4)
    assert other.weights[:7].min() > 0.5 > other.weights[7]
    default = judged(pool, solver=solver)
    expected = w if solver == "published" else other
    assert default.weights.tolist() == expected.weights.tolist()


def test_unknown_judgements_are_refused() -> None:
    with pytest.raises(ConfigError) as caught:
        FilterConfig(judged_by="luck")
    assert str(caught.value) == "judged_by is 'luck'; choose auto, w, leave-one-out."
