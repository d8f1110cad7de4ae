import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from filtering.features.reduction import reduce_features
from filtering.sequence import transitions
from filtering.weights.problem import Problem
from filtering.weights.solvers import annealed, solver_named, trust
from teasim.errors import ConfigError
from tests.filtering.simulator import SimulatedPool, pool_of


def problem_of(pool: SimulatedPool) -> Problem:
    rows = transitions(reduce_features(pool.features), pool.labels, pool.n_subtasks)
    return Problem(rows, ridge=0.01)


@given(
    st.lists(st.floats(0.0, 50.0), min_size=2, max_size=20),
    st.floats(0.1, 0.9),
    st.floats(0.01, 10.0),
)
def test_trust_lies_in_0_1_and_sums_to_m(losses: list[float], share: float, tau: float) -> None:
    trusted = share * len(losses)
    weights = trust(np.array(losses), trusted, tau)
    assert ((weights >= 0) & (weights <= 1)).all()
    assert weights.sum() == pytest.approx(trusted, abs=1e-6)
    order = np.argsort(losses)
    assert (np.diff(weights[order]) <= 1e-12).all()


@pytest.mark.parametrize("kind", ["seq_2", "seq_3"])
def test_annealed_trusts_only_correct_demonstrations(kind: str) -> None:
    pool = pool_of(10, kind, 4, seed=1)
    solution = annealed(problem_of(pool), 7.0)
    assert solution.weights.sum() == pytest.approx(7.0, abs=1e-6)
    assert solution.weights[~pool.correct].max() < 0.01
    again = annealed(problem_of(pool), 7.0)
    assert np.array_equal(solution.weights, again.weights)


def test_unknown_solver_is_refused_with_the_choices() -> None:
    with pytest.raises(ConfigError) as caught:
        solver_named("newton")
    assert str(caught.value) == "Unknown solver 'newton'; choose annealed."
