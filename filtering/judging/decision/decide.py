"""From the evidence about a pool to probabilities, and to words about the pool as a whole."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from threadpoolctl import threadpool_limits  # type: ignore[import-untyped]

from filtering.judging.decision.description import describe
from filtering.judging.decision.model import DecisionModel, shipped_model
from filtering.judging.decision.observed import Observed, canonical
from filtering.judging.decision.prior.pools import FACTS, MOST_DEMOS
from filtering.judging.evidence import Evidence
from teasim.common.arrays import Array

FEWEST = 3
"""Fewest demonstrations of a pool that is judged."""
ROUNDS = 3
"""Number of random divisions of a larger pool into groups of at most MOST_DEMOS."""
LIKELY = 0.5
"""Probability from which a fact about the pool is stated."""
MAJORITY_DOUBT = 0.2
"""Probability of an incorrect majority from which the pool has no majority to rely on. Below
LIKELY, because all probabilities are wrong where the majority is."""
THIN = 0.4
"""Share of flagged demonstrations from which the majority is too thin to rely on: which
of two parts of like size is the correct one, no pool can tell."""


@dataclass(frozen=True)
class PoolDecision:
    """What is decided about the D demonstrations of a pool."""

    probabilities: Array
    """(D,) probability that each demonstration is incorrect."""
    facts: Mapping[str, float]
    """Probability of each of FACTS about the pool."""
    cost: float
    """False alarms that a miss is worth."""
    sha256: str
    """Hash of the weights of the model."""

    @property
    def cut(self) -> float:
        """Probability above which a demonstration is flagged: there it costs less than a miss."""
        return 1 / (1 + self.cost)

    @property
    def flagged(self) -> NDArray[np.bool_]:
        """(D,) True for demonstrations called incorrect."""
        return self.probabilities > self.cut

    @property
    def expected_recall(self) -> float:
        """Share of the incorrect demonstrations that is flagged if the probabilities are right."""
        total = float(self.probabilities.sum())
        return float(self.probabilities[self.flagged].sum()) / total if total > 0 else 1.0

    @property
    def words(self) -> tuple[str, ...]:
        """Return one or more of clean, contaminated, no majority, too noisy to judge, several ways.

        Each is followed by what it means.
        """
        found = []
        if self.flagged.any():
            found.append("contaminated: some demonstrations are probably incorrect")
        elif self.facts["clean"] >= LIKELY:
            found.append("clean: probably no demonstration is incorrect")
        thin = self.flagged.mean() >= THIN
        if thin or self.facts["majority incorrect"] >= MAJORITY_DOUBT:
            found.append(
                "no majority: perhaps more than half of the demonstrations are incorrect in the "
                "same way; the majority may be wrong"
            )
        if self.facts["noisy"] >= LIKELY and self.expected_recall < LIKELY:
            found.append(
                "too noisy to judge: the segments are so unreliable that most incorrect "
                "demonstrations would be missed"
            )
        if self.facts["several ways"] >= LIKELY:
            found.append("several ways of doing it: no order of steps is shared by most")
        return tuple(found or ["unsure: some may be incorrect, but none of them stands out"])


def observed(evidence: Evidence) -> Observed:
    """Return what the decision reads of the evidence."""
    ineffective = evidence.ineffective
    reliability = evidence.reliability
    return Observed(
        evidence.step_lists,
        None if reliability is None else tuple(reliability),
        None if ineffective is None else tuple(ineffective),
        evidence.told,
    )


def decide(pool: Observed, cost: float, model: DecisionModel | None = None) -> PoolDecision:
    """Judge a pool of FEWEST or more demonstrations.

    The result depends neither on the names of labels nor on the order of the demonstrations, and
    is the same for demonstrations that cannot be told apart.

    Args:
        pool: the demonstrations.
        cost: false alarms that a miss is worth, above 0.
        model: fitted decision; by default the one that is part of the package.
    """
    model = shipped_model() if model is None else model
    own = canonical(pool)
    with threadpool_limits(limits=1, user_api="blas"):
        logits, facts = _judge(own.pool, model)
    # Equal demonstrations may differ in the last bit by their places in the arrays.
    _, kinds = np.unique(own.kinds, return_inverse=True)
    logits = (np.bincount(kinds, logits) / np.bincount(kinds))[kinds]
    probabilities = np.empty(len(logits))
    probabilities[own.rows] = expit(logits)
    stated = dict(zip(FACTS, expit(facts).tolist(), strict=True))
    return PoolDecision(probabilities, stated, cost, model.sha256)


def _judge(pool: Observed, model: DecisionModel) -> tuple[Array, Array]:
    """Return logits of demonstrations (D,) and facts (4,); larger pools are judged by groups."""
    demos = len(pool.steps)
    if demos <= MOST_DEMOS:
        return model.logits(describe(pool))
    rng = np.random.default_rng(0)
    logits, facts, parts = np.zeros(demos), np.zeros(len(FACTS)), 0
    for _ in range(ROUNDS):
        for group in np.array_split(rng.permutation(demos), -(-demos // MOST_DEMOS)):
            chosen = canonical(pool.chosen(group))
            found, stated = model.logits(describe(chosen.pool))
            logits[group[chosen.rows]] += found / ROUNDS
            facts, parts = facts + stated, parts + 1
    return logits, facts / parts
