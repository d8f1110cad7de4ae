"""The ways to judge a pool that are compared: ours, the paper's, and baselines."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.judging.baselines import BASELINES
from filtering.judging.config import JudgingConfig
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.sequence import transitions
from filtering.judging.equation3.solvers import solver_named
from filtering.judging.evidence import Evidence
from filtering.judging.judges import by_norm
from filtering.judging.thresholds import group_weights, probability_incorrect
from policies.experiments.detection import Judged, told_how_many

TRUSTED = 0.5
"""M / D of equation 3, as in the paper."""


@dataclass(frozen=True)
class Question:
    """A pool to be judged, with the truth, which only baselines and the oracle may look at."""

    evidence: Evidence
    """What is seen."""
    wrong: NDArray[np.bool_]
    """(D,) which demonstrations are incorrect."""
    seed: int = 0
    """Seed of random answers."""


@dataclass(frozen=True)
class Answer:
    """What a method says about D demonstrations."""

    flagged: NDArray[np.bool_]
    """(D,) which are called incorrect."""
    losses: NDArray[np.float64]
    """(D,) higher is worse."""
    probabilities: NDArray[np.float64] | None = None
    """(D,) of being incorrect; None where none are said."""


Method = Callable[[Question], Answer]
"""Judges a pool."""


def norm(question: Question) -> Answer:
    """Judge by the default score and the cut between clusters of its losses."""
    found = by_norm(question.evidence, JudgingConfig())
    losses = found.losses
    return Answer(found.grouping.flagged, losses, probability_incorrect(losses))


def learned(question: Question) -> Answer:
    """Judge by the default score with the learned decision."""
    found = by_norm(question.evidence, JudgingConfig(decision="learned"))
    assert found.decision is not None
    return Answer(found.grouping.flagged, found.losses, found.decision.probabilities)


def equation_3(question: Question) -> Answer:
    """Judge as the paper does: w of equation 3 by SLSQP, two groups by k-means (section 3.3)."""
    weights = paper_weights(question.evidence)
    return Answer(group_weights(weights, "2", "kmeans").flagged, -weights)


def paper_weights(evidence: Evidence, solver: str = "published") -> NDArray[np.float64]:
    """Return w (D,) of equation 3 itself."""
    rows = transitions(evidence.states, evidence.labels, len(evidence.subtasks))
    problem = Problem(rows, JudgingConfig().ridge)
    solved = solver_named(solver).fit(problem, TRUSTED * rows.n_demos)
    return np.asarray(solved.weights_)


def length(question: Question) -> Answer:
    """Flag the shortest demonstrations; told how many are incorrect."""
    losses = BASELINES["length"](question.evidence.step_lists)
    return Answer(told_how_many(losses, int(question.wrong.sum())), losses)


def chance(question: Question) -> Answer:
    """Flag demonstrations at random; told how many are incorrect."""
    losses = np.random.default_rng(question.seed).random(len(question.wrong))
    return Answer(told_how_many(losses, int(question.wrong.sum())), losses)


def oracle(question: Question) -> Answer:
    """Read the labels: what no filter can exceed."""
    return Answer(question.wrong, question.wrong.astype(np.float64), question.wrong.astype(float))


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "norm": norm,
        "norm, learned decision": learned,
        "equation 3": equation_3,
        "length": length,
        "random": chance,
        "oracle": oracle,
    }
)
"""Every method by its name in the tables."""
OURS = "norm"
"""The method that is compared with the paper's numbers."""


def judge_all(question: Question, names: tuple[str, ...]) -> dict[str, Judged]:
    """Return what every method says about a pool; demonstrations are `names` (D,)."""
    wrong = tuple(map(bool, question.wrong))
    # The matrices are small: several BLAS threads would only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        answers = {name: method(question) for name, method in METHODS.items()}
    return {
        name: Judged(
            names,
            wrong,
            tuple(map(bool, said.flagged)),
            tuple(map(float, said.losses)),
            None if said.probabilities is None else tuple(map(float, said.probabilities)),
        )
        for name, said in answers.items()
    }
