"""The ways to judge a pool that are compared: ours, the paper's, and baselines."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.demo_filter import DemoFilter
from filtering.judging.baselines import BASELINES
from filtering.judging.config import JudgingConfig
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.sequence import transitions
from filtering.judging.equation3.solvers import solver_named
from filtering.judging.evidence import Evidence
from filtering.judging.judges import by_norm
from filtering.judging.thresholds import (
    Grouping,
    as_many_as_asked,
    group_weights,
    probability_incorrect,
)
from policies.experiments.detection import Judged, told_how_many

OURS = "default filter"
"""What `teasim filter` does: it finds the sub-tasks by itself or with a fitted network, and looks
at moments of the videos. Compared with the paper's numbers."""
NORM = "norm"
"""The score norm on given segments. Compared with the paper's numbers at its own segmentation."""
LEARNED = "norm, learned decision"
"""The same score with the learned decision."""
THRESHOLDS = ("kmeans", "gmm", "minibatch")
"""Clusterings of the weights (the paper, section 3.3 and appendix E)."""
SOLVERS = ("published", "annealed")
"""Solvers of equation 3 whose weights are shown."""
TRUSTED = 0.5
"""M / D of equation 3, as in the paper."""


@dataclass(frozen=True)
class Question:
    """A pool to be judged, with the truth, which only baselines and the oracle may look at."""

    evidence: Evidence
    """What is seen."""
    kinds: NDArray[np.int64]
    """(D,) kind of each demonstration, 0 is correct."""
    names: tuple[str, ...]
    """(D,) identity of each demonstration."""
    alone: DemoFilter | None = None
    """The default filter, fitted to the videos of the pool; None where it is not asked."""
    seed: int = 0
    """Seed of random answers."""

    @property
    def wrong(self) -> NDArray[np.bool_]:
        """(D,) which demonstrations are incorrect."""
        return self.kinds > 0


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


def from_videos(fitted: DemoFilter) -> Answer:
    """Return what the default filter said of a pool."""
    return Answer(fitted.flagged_, fitted.losses_, fitted.probabilities_)


def norm(question: Question) -> Answer:
    """Judge by the score norm and the cut between clusters of its losses."""
    found = by_norm(question.evidence, JudgingConfig(decision="clusters"))
    losses = found.losses
    return Answer(found.grouping.flagged, losses, probability_incorrect(losses))


def learned(question: Question) -> Answer:
    """Judge by the score norm with the learned decision."""
    found = by_norm(question.evidence, JudgingConfig(decision="learned"))
    assert found.decision is not None
    return Answer(found.grouping.flagged, found.losses, found.decision.probabilities)


def equation_3(question: Question) -> Answer:
    """Judge as the paper does: w of equation 3 by SLSQP, two groups by k-means (section 3.3)."""
    return by_threshold(paper_weights(question.evidence), "kmeans")


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
        NORM: norm,
        LEARNED: learned,
        "equation 3": equation_3,
        "length": length,
        "random": chance,
        "oracle": oracle,
    }
)
"""Every method that judges given segments, by its name in the tables."""


def judge_all(question: Question) -> dict[str, Any]:
    """Return what every method says about a pool, as JSON can hold it."""
    # The matrices are small: several BLAS threads would only wait for each other.
    with threadpool_limits(limits=1, user_api="blas"):
        answers = _alone(question) | {name: judge(question) for name, judge in METHODS.items()}
    return {name: as_judged(question, said) for name, said in answers.items()}


def judge_thresholds(question: Question) -> dict[str, Any]:
    """Return what each clustering of the weights of equation 3 says, and what the scores do."""
    with threadpool_limits(limits=1, user_api="blas"):
        weights = paper_weights(question.evidence)
        answers = _alone(question)
        answers |= {name: METHODS[name](question) for name in (NORM, LEARNED)}
        answers |= {f"equation 3, {name}": by_threshold(weights, name) for name in THRESHOLDS}
    return {name: as_judged(question, said) for name, said in answers.items()}


def weigh_all(question: Question) -> dict[str, Any]:
    """Return the weights of a pool by every solver and score, and the groups made of them.

    Every method is told the number of groups, as the paper's is.
    """
    told = str(int(question.kinds.max()) + 1)
    with threadpool_limits(limits=1, user_api="blas"):
        weights = {f"equation 3, {s}": paper_weights(question.evidence, s) for s in SOLVERS}
        grouped = {name: (w, group_weights(w, told).groups) for name, w in weights.items()}
        found = by_norm(question.evidence, JudgingConfig(groups=told))
        grouped[NORM] = (found.weights, found.grouping.groups)
    if question.alone is not None:
        fitted = question.alone
        natures = Grouping(fitted.groups_, fitted.threshold_, fitted.group_names_)
        groups = as_many_as_asked(natures, fitted.weights_, told).groups
        grouped = {OURS: (fitted.weights_, groups), **grouped}
    said = {
        name: {"weights": w.tolist(), "groups": groups.tolist()}
        for name, (w, groups) in grouped.items()
    }
    return {"names": list(question.names), "kinds": question.kinds.tolist(), "methods": said}


def _alone(question: Question) -> dict[str, Answer]:
    """Return what the default filter said, where it was asked."""
    return {} if question.alone is None else {OURS: from_videos(question.alone)}


def by_threshold(weights: NDArray[np.float64], threshold: str) -> Answer:
    """Cut weights (D,) into two groups."""
    return Answer(group_weights(weights, "2", threshold).flagged, -weights)


def as_judged(question: Question, said: Answer) -> dict[str, Any]:
    """Return an answer beside the truth, as JSON can hold it."""
    judged = Judged(
        question.names,
        tuple(map(bool, question.wrong)),
        tuple(map(bool, said.flagged)),
        tuple(map(float, said.losses)),
        None if said.probabilities is None else tuple(map(float, said.probabilities)),
    )
    return asdict(judged)
