"""From a score to weights and groups: the two ways of judging a pool, behind one form.

* `norm`, the default: the losses of `norm_score`, and what steps add of which nothing came; cut and
  grouped by `decision`.
* `equation3`: the paper's conditional next-step model, trimmed, and k-means on its weights.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from filtering.judging.clusters import decide
from filtering.judging.equation3.problem import Problem
from filtering.judging.equation3.score import score
from filtering.judging.equation3.sequence import transitions
from filtering.judging.equation3.solvers import solver_named
from filtering.judging.findings import Findings, Places, find_departures, find_surprises
from filtering.judging.norm.norm_score import NormScore, score_steps
from filtering.judging.norm.precedence import Pairs, precedence_graph
from filtering.judging.norm.steps import Array, StepCounts, StepList, count_steps
from filtering.judging.thresholds import Grouping, group_weights
from teasim.common.registry import named
from teasim.pool import Span

IDLE_DOUBT = 1.0
"""Log-odds against a step in vain before it is looked at [nats]."""


@dataclass(frozen=True)
class Evidence:
    """What is known about the demonstrations of a pool; counts are made when asked for."""

    subtasks: tuple[str, ...]
    """Names of the T sub-task labels."""
    segments: tuple[tuple[Span, ...], ...]
    """Per demonstration its q segments."""
    states: Sequence[Array] = ()
    """Per demonstration (q, N): what each segment looks like, rows of mean squared length 1; empty
    where the score does not ask."""
    idle: Sequence[Array] | None = None
    """Per demonstration (q,): how surprising it is that so little came of each segment [nats]; None
    where nobody looked."""

    @cached_property
    def labels(self) -> list[list[int]]:
        """Per demonstration the label numbers of its segments, 0..T-1."""
        numbers = {name: number for number, name in enumerate(self.subtasks)}
        return [[numbers[span.subtask] for span in spans] for spans in self.segments]

    @cached_property
    def counts(self) -> StepCounts:
        """Occurrence, precedence and next steps."""
        demos = [
            StepList(tuple(labels), tuple(span.stop - span.start for span in spans))
            for labels, spans in zip(self.labels, self.segments, strict=True)
        ]
        return count_steps(demos, len(self.subtasks))

    @property
    def places(self) -> Places:
        """Where the steps are."""
        return Places(self.segments, self.subtasks)


@dataclass(frozen=True)
class Rule:
    """How the evidence is to be judged; the settings are those of the filter."""

    groups: str
    threshold: str
    solver: str
    trusted_share: float
    ridge: float
    precedence: Pairs
    tolerance: float


@dataclass(frozen=True)
class Verdict:
    """What is to be thought of the demonstrations of a pool."""

    losses: Array
    """(D,) surprise [nats], higher is worse."""
    weights: Array
    """(D,) in [0, 1], 1 for a usual demonstration."""
    grouping: Grouping
    """Groups and threshold on the weights."""
    trust: Array
    """(D,) how much each demonstration shapes what is usual, in [0, 1]."""
    findings: tuple[Findings, ...]
    """Per demonstration its strange places, the one to name first."""
    objective: float | None = None
    """Value of equation 3 [nats per step]; None where it was not asked."""


Judge = Callable[[Evidence, Rule], Verdict]


def by_norm(evidence: Evidence, rule: Rule) -> Verdict:
    """Judge by what most of the pool does (the default score)."""
    counts = evidence.counts
    if rule.precedence:
        counts = counts.restricted(precedence_graph(rule.precedence, evidence.subtasks))
    found = score_steps(counts, tolerance=rule.tolerance, n_groups=3 if rule.groups == "3" else 2)
    vain = in_vain(found, evidence)
    worst_vain = np.array([nats.max(initial=0.0) for nats in vain])
    losses = found.losses + worst_vain
    decision = decide(losses, found.left_out + worst_vain > found.out_of_order, rule.groups)
    grouping = decision.grouping
    if rule.threshold != "auto":
        grouping = group_weights(decision.weights, rule.groups, rule.threshold)
    findings = find_departures(found, evidence.labels, evidence.places, vain)
    return Verdict(losses, decision.weights, grouping, found.trust, findings)


def in_vain(found: NormScore, evidence: Evidence) -> list[Array]:
    """Return per demonstration (q,): what each segment adds of which nothing came [nats].

    A step in vain is at most as bad as one left out; and because few steps are in vain, IDLE_DOUBT
    nats of evidence are needed before one counts. Only the worst segment counts for the loss.
    """
    if evidence.idle is None:
        return [np.zeros(len(labels)) for labels in evidence.labels]
    return [
        np.clip(nats - IDLE_DOUBT, 0.0, usual[labels])
        for nats, usual, labels in zip(evidence.idle, found.usual, evidence.labels, strict=True)
    ]


def by_equation_3(evidence: Evidence, rule: Rule) -> Verdict:
    """Judge by the surprises of equation 3."""
    rows = transitions(evidence.states, evidence.labels, len(evidence.subtasks))
    problem = Problem(rows, rule.ridge)
    solved = solver_named(rule.solver).fit(problem, rule.trusted_share * rows.n_demos)
    found = score(problem, solved)
    return Verdict(
        losses=found.losses,
        weights=found.weights,
        grouping=group_weights(found.weights, rule.groups, _method(rule)),
        trust=solved.weights_,
        findings=find_surprises(rows, found, evidence.labels, evidence.places),
        objective=solved.objective_,
    )


def _method(rule: Rule) -> str:
    return "kmeans" if rule.threshold == "auto" else rule.threshold


JUDGES: Mapping[str, Judge] = MappingProxyType({"norm": by_norm, "equation3": by_equation_3})
"""Every way of judging by name."""


def judge_named(name: str) -> Judge:
    """Return a way of judging.

    Raises:
        ConfigError: there is none of that name.
    """
    return named("score", JUDGES, name)
