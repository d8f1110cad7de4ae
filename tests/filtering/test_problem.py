import numpy as np
import pytest
from scipy.optimize import approx_fprime

from filtering.features.reduction import reduce_features
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.sequence import transitions
from tests.filtering.simulator import pool_of


@pytest.fixture(scope="module")
def problem() -> Problem:
    pool = pool_of(4, "seq_3", 2, seed=0)
    rows = transitions(reduce_features(pool.features), pool.labels, pool.n_subtasks)
    return Problem(rows, ridge=0.01)


def test_gradient_agrees_with_finite_differences(problem: Problem) -> None:
    rng = np.random.default_rng(0)
    weights = rng.uniform(size=problem.rows.n_demos)
    point = rng.normal(size=problem.shape)

    def objective(flat: np.ndarray) -> float:
        return problem.objective(flat.reshape(problem.shape), weights)

    numeric = approx_fprime(point.ravel(), objective, 1e-6)
    assert np.allclose(problem.gradient(point, weights).ravel(), numeric, atol=1e-5)


def test_objective_is_the_weighted_mean_of_the_demo_losses_plus_the_ridge(
    problem: Problem,
) -> None:
    rng = np.random.default_rng(1)
    weights = rng.uniform(size=problem.rows.n_demos)
    point = rng.normal(size=problem.shape)
    expected = np.average(problem.demo_losses(point), weights=weights)
    expected += 0.005 * np.sum(point**2)
    assert problem.objective(point, weights) == pytest.approx(expected)


def test_demo_loss_is_equation_3(problem: Problem) -> None:
    """l_d = sum_s p(s|d) log z(s) - sum_i lambda_i sum_{s,t} p(s,t|d) f_i(s,t)."""
    point = np.random.default_rng(2).normal(size=problem.shape)
    rows = problem.rows
    for demo in range(rows.n_demos):
        mine = np.flatnonzero(rows.demos == demo)
        log_z = np.log(np.exp(rows.states[mine] @ point).sum(axis=1)).mean()
        features = np.zeros(problem.shape)
        for row in mine:
            features[:, rows.nexts[row]] += rows.states[row] / len(mine)
        assert problem.demo_losses(point)[demo] == pytest.approx(log_z - (point * features).sum())


def test_with_lambda_zero_every_next_subtask_is_equally_likely(problem: Problem) -> None:
    losses = problem.demo_losses(np.zeros(problem.shape))
    assert np.allclose(losses, np.log(problem.rows.n_subtasks + 1))


def test_solution_is_stationary_and_does_not_depend_on_the_start(problem: Problem) -> None:
    weights = np.ones(problem.rows.n_demos)
    found = problem.solve(weights)
    elsewhere = problem.solve(weights, np.random.default_rng(3).normal(size=problem.shape))
    assert np.abs(problem.gradient(found, weights)).max() < 1e-5
    assert np.allclose(found, elsewhere, atol=1e-3)


def test_weight_zero_equals_leaving_the_demonstration_out() -> None:
    pool = pool_of(4, "seq_3", 2, seed=0)
    rows = transitions(pool.features, pool.labels, pool.n_subtasks)
    fewer = transitions(pool.features[1:], pool.labels[1:], pool.n_subtasks)
    with_zero = Problem(rows, 0.01).solve(np.array([0.0, 1, 1, 1, 1, 1]))
    without = Problem(fewer, 0.01).solve(np.ones(5))
    assert np.allclose(with_zero, without, atol=1e-3)
