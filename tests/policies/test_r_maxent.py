"""Five states solved by hand, and the half-steps against what they claim to be."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import minimize

from policies.learners.r_maxent import (
    Problem,
    RMaxEntConfig,
    demo_losses,
    fit_multipliers,
    solve,
)
from teasim.common.trimming import soft_trim
from tests.policies.learning import make

STATES = 5
RIDGE = 0.1 / np.log(3)


def five_states(wrong=(2,), demos=4):
    """Every demonstration passes states 0 to 4 and chooses 0; the last errs in states `wrong`."""
    labels = np.zeros((demos, STATES), dtype=np.int64)
    labels[-1, list(wrong)] = 1
    return Problem(
        np.tile(np.eye(STATES), (demos, 1)),
        labels.ravel(),
        np.repeat(np.arange(demos), STATES),
        np.ones(demos),
        2,
    )


def test_five_states_by_hand():
    """Three demonstrations agree and one errs; M = 2 of 4, one-hot features, two sub-tasks.

    The one that errs gets weight 0, the three share M alike: 2/3 each. Each state then has
    p(s) = 1/5 and one choice. lambda is (x, -x) by symmetry, and the gradient is 0 where
    ridge x = (1 - p) / 5 with p = sigmoid(2 x). With ridge = 0.1 / ln 3: x = ln 3 / 2, p = 3/4.
    """
    solution = solve(five_states(), RMaxEntConfig(ridge=RIDGE))
    np.testing.assert_allclose(solution.weights, [2 / 3, 2 / 3, 2 / 3, 0], atol=1e-9)
    x = np.log(3) / 2
    np.testing.assert_allclose(solution.multipliers, [[x, -x]] * STATES, atol=1e-7)
    chances = np.exp(solution.multipliers) / np.exp(solution.multipliers).sum(axis=1)[:, None]
    np.testing.assert_allclose(chances, [[0.75, 0.25]] * STATES, atol=1e-7)
    losses = demo_losses(five_states(), solution.multipliers)
    np.testing.assert_allclose(losses[:3], np.log(4 / 3), atol=1e-7)
    np.testing.assert_allclose(losses[3], (4 * np.log(4 / 3) + np.log(4)) / 5, atol=1e-7)


def test_all_demonstrations_alike_share_the_weight():
    solution = solve(five_states(wrong=()), RMaxEntConfig())
    np.testing.assert_allclose(solution.weights, 0.5, atol=1e-9)


loss_lists = arrays(float, st.integers(2, 9), elements=st.floats(0, 10))


@given(loss_lists, st.floats(0.05, 0.95), st.floats(0.01, 1.0))
def test_trust_sums_to_m_and_falls_with_the_loss(losses, share, temperature):
    copies = np.linspace(0.5, 2, len(losses))
    weights = soft_trim(losses, copies, share * copies.sum(), temperature)
    assert copies @ weights == pytest.approx(share * copies.sum())
    assert ((weights >= 0) & (weights <= 1)).all()
    assert (np.diff(weights[np.argsort(losses)]) <= 1e-12).all()


def test_the_multipliers_match_the_feature_expectations():
    random = np.random.default_rng(0)
    rows = Problem(
        random.normal(size=(12, 4)),
        random.integers(0, 3, 12),
        np.repeat(np.arange(3), [3, 4, 5]),
        np.ones(3),
        3,
    )
    weights = np.array([0.5, 0.2, 0.3])
    multipliers = fit_multipliers(rows, weights, np.zeros((4, 3)), ridge=0.05)
    scores = np.exp(rows.features @ multipliers)
    each = (weights / [3, 4, 5])[rows.demos][:, None]
    gap = rows.features.T @ (each * (np.eye(3)[rows.labels] - scores / scores.sum(1)[:, None]))
    np.testing.assert_allclose(gap, 0.05 * multipliers, atol=1e-8)


def test_the_demonstration_that_errs_is_not_trusted(samples):
    weights = make("r-maxent").fit(samples, np.ones(5)).demo_weights_
    assert weights.sum() == pytest.approx(2.5)
    assert weights[4] < 1e-6


def test_one_the_pool_gives_no_weight_is_not_asked(samples):
    weights = make("r-maxent").fit(samples, np.array([1.0, 1, 0, 1, 1])).demo_weights_
    assert weights.shape == (4,)


def long_adversaries():
    """A chain of four states: three demonstrations go on, two go back, three times as often.

    Most decisions are wrong, most demonstrations are right.
    """
    good, bad = np.arange(4), np.tile(np.arange(4), 3)
    states = np.concatenate([good, good, good, bad, bad])
    labels = np.repeat([0, 1], [12, 24])
    demos = np.repeat(np.arange(5), [4, 4, 4, 12, 12])
    return Problem(np.eye(4)[states], labels, demos, np.ones(5), 2)


def test_adversaries_that_outvote_every_decision_are_found_and_plain_cloning_is_misled():
    problem = long_adversaries()
    cloned = fit_multipliers(
        problem, np.bincount(problem.demos) / len(problem.labels), np.zeros((4, 2)), 1e-2
    )
    assert (cloned.argmax(axis=1) == 1).all()
    solution = solve(problem, RMaxEntConfig())
    np.testing.assert_allclose(solution.weights, [5 / 6] * 3 + [0, 0], atol=1e-6)
    assert (solution.multipliers.argmax(axis=1) == 0).all()


def objective(problem, weights, multipliers, ridge):
    """Equation 3 with the ridge, without the entropy."""
    trusted = problem.copies.sum() / 2
    losses = demo_losses(problem, multipliers)
    return float(weights @ losses / trusted + ridge / 2 * (multipliers**2).sum())


@pytest.mark.parametrize("problem", [five_states(), five_states(wrong=(1, 3), demos=6)])
def test_it_is_at_least_as_good_as_the_solver_of_the_paper(problem):
    """Sequential quadratic programming over lambda and w at once, from lambda 0 and equal weights.

    Both trust the same demonstrations.
    """
    ridge, demos, size = 0.02, len(problem.copies), problem.features.shape[1] * 2

    def value(point):
        return objective(problem, point[:demos], point[demos:].reshape(-1, 2), ridge)

    start = np.append(np.full(demos, 0.5), np.zeros(size))
    theirs = minimize(
        value,
        start,
        method="SLSQP",
        bounds=[(0, 1)] * demos + [(None, None)] * size,
        constraints={"type": "eq", "fun": lambda point: point[:demos].sum() - demos / 2},
        options={"maxiter": 500, "ftol": 1e-12},
    )
    ours = solve(problem, RMaxEntConfig(ridge=ridge))
    assert objective(problem, ours.weights, ours.multipliers, ridge) <= theirs.fun + 1e-4
    assert theirs.x[demos - 1] == pytest.approx(ours.weights[-1], abs=1e-3)
