"""From evidence to weights and groups: the two scores behind one interface.

* `norm`, the default: the losses of `norm_score` plus those of ineffective steps. Who is flagged is
  decided by the learned `decision`, or by `norm.cut` between clusters of the losses.
* `equation3`: the conditional next-step model of the paper, trimmed. Either its weights w
  themselves are clustered, as published, or each demonstration is scored by models of the others.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from filtering.judging.config import JudgingConfig
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.score import score
from filtering.judging.equation3.sequence import transitions
from filtering.judging.equation3.solvers import solver_named
from filtering.judging.equation3.surprises import find_surprises
from filtering.judging.evidence import Evidence
from filtering.judging.explain import NO_STEP, Finding
from filtering.judging.judgement import Judgement
from filtering.judging.norm.cut import by_nature, decide
from filtering.judging.norm.departures import find_departures
from filtering.judging.norm.extras import find_extras
from filtering.judging.norm.norm_score import NormScore, score_steps
from filtering.judging.rules.legal import legal_evidence
from filtering.judging.rules.rules import charges_of, rules_of
from filtering.judging.rules.verdict import ruled
from filtering.judging.thresholds import Grouping, group_weights
from teasim.common.arrays import Array
from teasim.common.registry import named

if TYPE_CHECKING:
    from filtering.judging.decision.decide import PoolDecision

INEFFECTIVE_PRIOR = 1.0
"""Log-odds against an ineffective step before the video is examined [nats]. A round number, odds of
e to 1; detection with it is reported for rendered tea pools in docs/results.md."""

NO_STEP_OF_W = (
    "No single step stands out; the weights w of equation 3 always add up to M, so that one below "
    "1 need not mean that anything is odd."
)
"""What is said of a demonstration without findings that w judges."""

Judge = Callable[[Evidence, JudgingConfig], Judgement]
"""A score with its rule for weights and groups."""


def by_norm(evidence: Evidence, config: JudgingConfig) -> Judgement:
    """Judge by what most of the pool does (the default score).

    Raises:
        ConfigError: the rules of the user do not fit the pool, or there are fewer demonstrations
            than groups.
    """
    rules = rules_of(config, evidence.subtasks)
    charges = charges_of(rules, evidence.labels, evidence.places)
    obeys = np.array([not own for own in charges])
    return ruled(_by_usual(legal_evidence(evidence, rules), config, obeys), charges)


def _by_usual(evidence: Evidence, config: JudgingConfig, obeys: NDArray[np.bool_]) -> Judgement:
    """Judge by what is usual; `obeys` (D,) is True for those that break no rule of the user."""
    n_groups = 3 if config.groups == "3" else 2
    found = score_steps(evidence.counts, tolerance=config.tolerance, n_groups=n_groups)
    ineffective = ineffective_losses(found, evidence)
    worst = np.array([nats.max(initial=0.0) for nats in ineffective])
    losses = found.losses + worst
    left_out = found.left_out + worst > found.out_of_order
    findings = find_departures(found, evidence.labels, evidence.places, ineffective)
    if config.learns:
        findings = _with_extras(
            findings, find_extras(evidence.labels, found.trust, evidence.places)
        )
        extra = np.array([bool(own) and own[0].extra is not None for own in findings])
        decision = _learned(evidence, config.cost, obeys)
        numbers, names = by_nature(decision.flagged, left_out, extra)
        grouping = Grouping(numbers, (1 - decision.cut) * (numbers.max() > 0), names)
        p = decision.probabilities
        return Judgement(
            losses, 1 - p, grouping, found.trust, findings, decision=decision, probabilities=p
        )
    weights, grouping = decide(losses, left_out, config.groups)
    if config.threshold != "auto":
        grouping = group_weights(weights, config.groups, config.threshold)
    return Judgement(losses, weights, grouping, found.trust, findings)


def _with_extras(
    findings: Sequence[tuple[Finding, ...]], extras: Sequence[tuple[Finding, ...]]
) -> tuple[tuple[Finding, ...], ...]:
    """Add extra steps, which only the learned decision judges, by falling surprise."""
    return tuple(
        tuple(sorted((*own, *extra), key=lambda item: -round(item.surprise, 6)))
        for own, extra in zip(findings, extras, strict=True)
    )


def _learned(evidence: Evidence, cost: float, obeys: NDArray[np.bool_]) -> "PoolDecision":
    """Return the learned decision; those that break no rule are judged among themselves.

    What is said about the pool is then said about these, if they are enough to be judged.
    """
    # Imported here because torch takes a second.
    from filtering.judging.decision import decide as learned

    pool = learned.observed(evidence)
    found = learned.decide(pool, cost)
    if obeys.all() or obeys.sum() < learned.FEWEST:
        return found
    rest = learned.decide(pool.chosen(np.flatnonzero(obeys)), cost)
    probabilities = found.probabilities.copy()
    probabilities[obeys] = rest.probabilities
    return replace(rest, probabilities=probabilities)


def ineffective_losses(found: NormScore, evidence: Evidence) -> list[Array]:
    """Return per demonstration (q,): what each segment adds for being ineffective [nats].

    An ineffective step costs at most as much as leaving it out. Because few steps are ineffective,
    the first INEFFECTIVE_PRIOR nats of evidence do not count. Only the largest of these values is
    part of the loss of a demonstration.
    """
    if evidence.ineffective is None:
        return [np.zeros(len(labels)) for labels in evidence.labels]
    return [
        np.clip(nats - INEFFECTIVE_PRIOR, 0.0, usual[labels])
        for nats, usual, labels in zip(
            evidence.ineffective, found.usual, evidence.labels, strict=True
        )
    ]


def by_equation_3(evidence: Evidence, config: JudgingConfig) -> Judgement:
    """Judge by the surprises of equation 3, or as published by its weights w.

    The paper clusters w into a number of groups that it is told (section 3.3): the solver
    `published` with `groups` 2 or 3 and a `threshold` of kmeans, gmm or minibatch. Reasons come
    from the surprises in either case.

    Raises:
        ConfigError: there are too many different demonstrations for the solver, or fewer
            demonstrations than groups.
    """
    rows = transitions(evidence.states, evidence.labels, len(evidence.subtasks))
    problem = Problem(rows, config.ridge)
    solved = solver_named(config.solver).fit(problem, config.trusted_share * rows.n_demos)
    found = score(problem, solved)
    weights = solved.weights_ if config.by_w else found.weights
    threshold = "kmeans" if config.threshold == "auto" else config.threshold
    return Judgement(
        losses=solved.losses_ if config.by_w else found.losses,
        weights=weights,
        grouping=group_weights(weights, config.groups, threshold),
        trust=solved.weights_,
        findings=find_surprises(rows, found, evidence.labels, evidence.places),
        objective=solved.objective_,
        otherwise=NO_STEP_OF_W if config.by_w else NO_STEP,
    )


JUDGES: Mapping[str, Judge] = MappingProxyType({"norm": by_norm, "equation3": by_equation_3})
"""Every score by name."""


def judge_named(name: str) -> Judge:
    """Return the judge of a score.

    Raises:
        ConfigError: there is no score of that name.
    """
    return named("score", JUDGES, name)
