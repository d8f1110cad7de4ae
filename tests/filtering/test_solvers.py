"""Laws of all solvers of equation 3, and what each of them promises beyond."""

import time
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import approx_fprime

from filtering.features.reduction import reduce_features
from filtering.judging.equation3.alternating import Alternating
from filtering.judging.equation3.annealed import Annealed
from filtering.judging.equation3.exact import MOST, Exact
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.published import Published
from filtering.judging.equation3.score import leave_one_out
from filtering.judging.equation3.sequence import transitions
from filtering.judging.equation3.solver import Solver, concentrate, distinct_demos, fill, thinned
from filtering.judging.equation3.solvers import SOLVERS, solver_named
from teasim.common.errors import ConfigError
from teasim.common.trimming import soft_trim
from tests.filtering.simulator import SimulatedPool, pool_of

ORDERS = [[0, 1, 2], [0, 1, 2], [0, 1, 2], [0, 2], [0, 1, 2], [1, 0, 2], [0, 1, 2, 2]]
"""The first three are equal, the last but one is out of order."""


def problem_of(pool: SimulatedPool, components: int = 3) -> Problem:
    features = [rows[:, :components] for rows in reduce_features(pool.features)]
    return Problem(transitions(features, pool.labels, pool.n_subtasks), ridge=0.01)


def small(order: list[int] | None = None) -> Problem:
    """Step lists as one-hot states; equal step lists are equal demonstrations."""
    chosen = [ORDERS[k] for k in order or range(len(ORDERS))]
    return Problem(transitions([np.eye(3)[steps] for steps in chosen], chosen, 3), ridge=0.01)


def noisy(seed: int) -> Problem:
    rng = np.random.default_rng(seed)
    orders = [ORDERS[k % 4] for k in range(6)]
    states = [np.eye(3)[steps] + 0.3 * rng.normal(size=(len(steps), 3)) for steps in orders]
    return Problem(transitions(states, orders, 3), ridge=0.01)


def fitted(name: str, problem: Problem, trusted: float) -> Solver:
    return solver_named(name).fit(problem, trusted)


@pytest.mark.parametrize("trusted", [3.0, 3.5])
@pytest.mark.parametrize("name", SOLVERS)
def test_weights_lie_in_0_1_and_sum_to_m(name: str, trusted: float) -> None:
    found = fitted(name, small(), trusted)
    assert ((found.weights_ >= 0) & (found.weights_ <= 1)).all()
    assert found.weights_.sum() == pytest.approx(trusted, abs=1e-6)
    assert np.isfinite(found.multipliers_).all()
    assert found.losses_ == pytest.approx(small().demo_losses(found.multipliers_))
    assert found.n_iter_ >= 1
    assert isinstance(found.converged_, bool)


@pytest.mark.parametrize("name", SOLVERS)
def test_permuting_demonstrations_permutes_the_weights_to_the_last_bit(name: str) -> None:
    order = [4, 0, 6, 3, 5, 2, 1]
    there, here = fitted(name, small(), 3.5), fitted(name, small(order), 3.5)
    assert here.weights_.tolist() == there.weights_[order].tolist()
    assert here.losses_ == pytest.approx(there.losses_[order], abs=1e-12)


@pytest.mark.parametrize("trusted", [2.0, 3.5])
@pytest.mark.parametrize("name", SOLVERS)
def test_equal_demonstrations_get_equal_weights(name: str, trusted: float) -> None:
    """Also where fewer than all of them are trusted: their sum alone counts, so it is shared."""
    found = fitted(name, small(), trusted)
    assert len(set(found.weights_[[0, 1, 2, 4]].tolist())) == 1


@pytest.mark.parametrize("name", SOLVERS)
def test_fitting_again_changes_nothing(name: str) -> None:
    solver = fitted(name, noisy(0), 3.0)
    first = solver.weights_
    assert solver.fit(noisy(0), 3.0) is solver
    assert solver.weights_.tolist() == first.tolist()


@pytest.mark.parametrize("name", ["annealed", "alternating", "exact"])
def test_weights_are_0_or_1_where_no_demonstration_equals_another(name: str) -> None:
    assert set(fitted(name, noisy(1), 3.0).weights_) == {0.0, 1.0}
    halves = fitted(name, noisy(1), 3.5).weights_
    assert sorted(halves) == [0.0, 0.0, 0.5, 1.0, 1.0, 1.0]


@pytest.mark.parametrize("name", ["annealed", "alternating", "exact"])
def test_who_is_trusted_fits_best_and_the_value_is_that_of_the_weights(name: str) -> None:
    problem = noisy(2)
    found = fitted(name, problem, 3.0)
    assert found.losses_[found.weights_ == 1].max() <= found.losses_[found.weights_ == 0].min()
    assert found.objective_ == pytest.approx(problem.objective(found.multipliers_, found.weights_))
    best = problem.objective(problem.solve(found.weights_), found.weights_)
    assert found.objective_ == pytest.approx(best, abs=1e-8)


@pytest.mark.parametrize("name", ["annealed", "alternating", "exact"])
@pytest.mark.parametrize("kind", ["seq_2", "seq_3"])
def test_only_correct_demonstrations_are_trusted(name: str, kind: str) -> None:
    pool = pool_of(8, kind, 3, seed=1, noise=0.3)
    assert fitted(name, problem_of(pool), 5.0).weights_[~pool.correct].max() == 0


@pytest.mark.parametrize("trusted", [2.0, 3.0, 3.5])
@pytest.mark.parametrize("seed", range(3))
def test_exact_is_as_good_as_trying_everything_and_certified(seed: int, trusted: float) -> None:
    problem = noisy(seed)
    found = Exact().fit(problem, trusted)
    corners = []
    for chosen in combinations(range(6), int(trusted)):
        for part in set(range(6)) - set(chosen) if trusted % 1 else {chosen[0]}:
            weights = np.zeros(6)
            weights[part] = 0.5
            weights[list(chosen)] = 1.0
            corners.append(problem.objective(problem.solve(weights), weights))
    assert found.objective_ == pytest.approx(min(corners), abs=1e-8)
    assert found.lower_bound_ <= found.objective_ + 1e-12
    assert found.objective_ - found.lower_bound_ < 3e-6


@pytest.mark.parametrize("trusted", [2.0, 3.5, 5.0])
def test_exact_shares_out_equal_demonstrations(trusted: float) -> None:
    problem = small()
    found = Exact().fit(problem, trusted)
    rng = np.random.default_rng(0)
    for _ in range(200):
        weights = fill(rng.random(7), np.ones(7), trusted)
        assert found.objective_ <= problem.objective(problem.solve(weights), weights) + 1e-8
    assert found.objective_ - found.lower_bound_ < 3e-6


@pytest.mark.parametrize("name", ["annealed", "alternating"])
def test_small_pools_are_solved_to_the_certified_optimum(name: str) -> None:
    for seed in (7, 8):
        bound = Exact(1e-4).fit(noisy(seed), 3.0).lower_bound_
        assert fitted(name, noisy(seed), 3.0).objective_ - bound < 1e-3


@pytest.mark.parametrize("seed", [0, 6])
def test_annealed_reaches_the_optimum_where_there_is_no_majority(seed: int) -> None:
    """Random steps of random looks; with seed 6 the path alone ends beside the optimum."""
    rng = np.random.default_rng(seed)
    orders = [rng.integers(0, 3, size=n).tolist() for n in rng.integers(1, 6, size=8)]
    states = [rng.normal(size=(len(steps), 2)) for steps in orders]
    problem = Problem(transitions(states, orders, 3), ridge=0.01)
    certified = Exact(1e-4).fit(problem, 4.0)
    assert Annealed().fit(problem, 4.0).objective_ - certified.lower_bound_ < 1e-3


def test_alternating_starts_differ_by_seed_and_end_alike() -> None:
    problem = noisy(4)
    first, other = Alternating(seed=0).fit(problem, 3.0), Alternating(seed=1).fit(problem, 3.0)
    assert first.n_iter_ != other.n_iter_
    assert first.objective_ == pytest.approx(other.objective_, abs=1e-6)
    assert first.converged_


def test_published_solves_the_ridge_problem_when_given_the_ridge() -> None:
    problem = noisy(3)
    found = Published(ridge=0.01).fit(problem, 3.0)
    assert found.converged_
    assert found.objective_ == pytest.approx(
        problem.objective(found.multipliers_, found.weights_), abs=1e-9
    )
    best = problem.objective(problem.solve(found.weights_), found.weights_)
    assert found.objective_ == pytest.approx(best, abs=1e-3)


def test_published_begins_uniform_and_without_a_ridge_lambda_grows() -> None:
    problem = noisy(3)
    free, held = Published().fit(problem, 3.0), Published(ridge=0.01).fit(problem, 3.0)
    assert np.abs(free.multipliers_).max() > 2 * np.abs(held.multipliers_).max()
    assert free.objective_ < held.objective_


def test_curvature_agrees_with_finite_differences_of_the_gradient() -> None:
    problem = small()
    rng = np.random.default_rng(0)
    weights, point = rng.random(7), rng.normal(size=problem.shape)

    def slope(flat: np.ndarray) -> np.ndarray:
        return problem.gradient(flat.reshape(problem.shape), weights).ravel()

    numeric = approx_fprime(point.ravel(), slope, 1e-6)
    assert problem.curvature(point, weights) == pytest.approx(numeric, abs=1e-5)


def test_newton_and_l_bfgs_find_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    problem, weights = noisy(5), np.array([1.0, 0.0, 0.5, 1.0, 0.2, 0.0])
    newton = problem.solve(weights)
    monkeypatch.setattr("filtering.judging.equation3.problem.MOST_FOR_NEWTON", 0)
    assert problem.solve(weights) == pytest.approx(newton, abs=1e-4)


def test_in_a_large_pool_one_newton_step_leaves_one_out(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(0)
    orders = [ORDERS[k % 7] for k in range(60)]
    states = [np.eye(3)[steps] + 0.2 * rng.normal(size=(len(steps), 3)) for steps in orders]
    problem = Problem(transitions(states, orders, 3), ridge=0.01)
    weights = np.where(np.arange(60) % 7 == 3, 0.0, 1.0)
    multipliers = problem.solve(weights)
    refitted = leave_one_out(problem, weights, multipliers)
    monkeypatch.setattr("filtering.judging.equation3.score.MOST_REFITS", 0)
    stepped = leave_one_out(problem, weights, multipliers)
    moved = np.abs(refitted - problem.log_probabilities(multipliers)).max()
    assert np.abs(stepped - refitted).max() < 0.2 * moved


def test_a_large_pool_is_solved_in_seconds() -> None:
    rng = np.random.default_rng(0)
    orders = [[0, 1, 2, 3, 4] if k % 5 else [0, 1, 3, 4] for k in range(1500)]
    states = [np.eye(5)[steps] + 0.2 * rng.normal(size=(len(steps), 5)) for steps in orders]
    problem = Problem(transitions(states, orders, 5), ridge=0.01)
    began = time.process_time()
    found = Annealed().fit(problem, 750.0)
    assert time.process_time() - began < 20
    assert found.weights_[::5].max() == 0


def test_kinds_are_numbered_by_content_and_name_their_first() -> None:
    kinds, firsts = distinct_demos(small())
    assert kinds[[0, 1, 2, 4]].tolist() == [kinds[0]] * 4
    assert len(firsts) == 4
    assert kinds[firsts].tolist() == [0, 1, 2, 3]
    others, _ = distinct_demos(small([6, 5, 4, 3, 2, 1, 0]))
    assert others.tolist() == kinds[::-1].tolist()


def test_concentration_never_raises_the_value() -> None:
    problem, sizes = noisy(6), np.ones(6)
    start = np.random.default_rng(0).normal(size=problem.shape)
    values = []
    for most in (1, 2, 3, 10):
        multipliers, weights, _ = concentrate(problem, sizes, 3.0, start, most)
        values.append(problem.objective(multipliers, weights))
    assert (np.diff(values) <= 1e-9).all()


@given(
    st.lists(st.tuples(st.floats(0.0, 50.0), st.integers(1, 4)), min_size=2, max_size=20),
    st.floats(0.1, 0.9),
    st.floats(0.01, 10.0),
)
@settings(deadline=None)
def test_trust_and_fill_spend_m_and_prefer_low_losses(
    kinds: list[tuple[float, int]], share: float, tau: float
) -> None:
    losses, sizes = np.array([loss for loss, _ in kinds]), np.array([n for _, n in kinds], float)
    trusted = share * sizes.sum()
    order = np.argsort(losses, kind="stable")
    soft = sizes * soft_trim(losses, sizes, trusted, tau)
    for weights in (soft, fill(losses, sizes, trusted)):
        assert ((weights >= 0) & (weights <= sizes)).all()
        assert weights.sum() == pytest.approx(trusted, abs=1e-6)
        assert (np.diff((weights / sizes)[order]) <= 1e-12).all()


def test_thinning_keeps_both_ends_and_small_numbers() -> None:
    assert thinned(4, 9).tolist() == [0, 1, 2, 3]
    assert thinned(101, 3).tolist() == [0, 50, 100]


@pytest.mark.parametrize("trusted", [0.0, 7.0, 9.0])
def test_impossible_numbers_of_trusted_are_refused(trusted: float) -> None:
    with pytest.raises(ConfigError) as caught:
        Annealed().fit(small(), trusted)
    assert str(caught.value) == (
        f"{trusted} trusted demonstrations were asked for; choose a number between 0 and 7."
    )


def test_exact_refuses_what_it_would_never_finish() -> None:
    rng = np.random.default_rng(0)
    orders = [[0, 1, 2]] * (MOST + 1)
    problem = Problem(transitions([rng.random((3, 2)) for _ in orders], orders, 3), 0.01)
    with pytest.raises(ConfigError) as caught:
        Exact().fit(problem, 5.0)
    assert str(caught.value) == (
        "The pool has 25 different demonstrations, and the solver 'exact' takes 24 at most; "
        "choose another solver."
    )


def test_unknown_solver_is_refused_with_the_choices() -> None:
    with pytest.raises(ConfigError) as caught:
        solver_named("newton")
    assert str(caught.value) == (
        "Unknown solver 'newton'; choose annealed, alternating, exact, published."
    )
