import numpy as np
import pytest
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.features.reduction import reduce_features
from filtering.judging.equation3.annealed import Annealed
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.score import Score, graded, score, worst_first
from filtering.judging.equation3.sequence import transitions
from filtering.judging.thresholds import group_weights
from tests.filtering.simulator import SEQ_1, SimulatedPool, pool_of, simulate


def score_of(pool: SimulatedPool) -> Score:
    rows = transitions(reduce_features(pool.features), pool.labels, pool.n_subtasks)
    problem = Problem(rows, ridge=0.01)
    with threadpool_limits(limits=1, user_api="blas"):
        return score(problem, Annealed().fit(problem, len(pool.labels) / 2))


@pytest.mark.parametrize("noise", [0.5, 2.0])
@pytest.mark.parametrize(("kind", "count"), [("seq_3", 4), ("seq_2", 4), ("seq_3", 1)])
def test_all_incorrect_are_flagged_and_no_correct_one(kind: str, count: int, noise: float) -> None:
    for seed in range(2):
        pool = pool_of(10, kind, count, seed=seed, noise=noise)
        flagged = group_weights(score_of(pool).weights).flagged
        assert np.array_equal(flagged, ~pool.correct)


@pytest.mark.parametrize("noise", [0.5, 2.0])
def test_in_a_clean_pool_nothing_is_flagged(noise: float) -> None:
    for seed in range(2):
        result = score_of(pool_of(12, "seq_3", 0, seed=seed, noise=noise))
        assert not group_weights(result.weights).flagged.any()


def test_permuting_demonstrations_permutes_weights() -> None:
    pool = pool_of(6, "seq_3", 3, seed=2)
    order = np.random.default_rng(0).permutation(9)
    permuted = SimulatedPool(
        [pool.features[i] for i in order], [pool.labels[i] for i in order], pool.correct[order]
    )
    assert np.allclose(score_of(permuted).losses, score_of(pool).losses[order], atol=1e-3)


def test_equal_demonstrations_get_equal_weights() -> None:
    pool = pool_of(6, "seq_3", 2, seed=3)
    bad = int(np.flatnonzero(~pool.correct)[0])
    twice = SimulatedPool(
        [*pool.features, pool.features[bad]],
        [*pool.labels, pool.labels[bad]],
        np.append(pool.correct, False),
    )
    losses = score_of(twice).losses
    assert losses[bad] == pytest.approx(losses[-1], abs=1e-4)


def test_one_defect_is_not_averaged_away_by_length() -> None:
    """The same omission costs about as much in a demonstration of 8 steps as in one of 20."""
    long_task = SEQ_1 * 3
    for sequence in (SEQ_1, long_task):
        defect = sequence[:3] + sequence[4:]
        pool = simulate([sequence] * 9 + [defect], [True] * 9 + [False], seed=4)
        losses = score_of(pool).losses
        assert losses[-1] > 1.0
        assert losses[:-1].max() < 0.5


def test_weights_fall_from_1_with_the_loss() -> None:
    losses = np.array([0.0, 0.0, 0.0, 0.0, 1.0, 5.0])
    weights = graded(losses)
    assert weights.tolist() == pytest.approx([1, 1, 1, 1, np.exp(-1), np.exp(-5)])
    assert (graded(np.full(4, 7.0)) == 1).all()


def test_worst_surprise_counts_in_full() -> None:
    assert worst_first(np.array([1.0, 4.0, 2.0])) == pytest.approx(4 + 1 + 0.25)
    assert worst_first(np.zeros(5)) == 0.0
