"""Evidence in which everything that the user calls legal looks like what is usual.

Scores compare a demonstration with the others. So a legal deviation is undone before they see it:
an optional step that is left out is put where it usually is, a legal order becomes the usual one,
and where rules of order are given, whose breach is judged by themselves, the order of steps says
nothing any more.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from filtering.judging.evidence import Evidence
from filtering.judging.places import Supposed, place_of, usual_order
from filtering.judging.rules.rules import Rules
from filtering.segmentation.segments import label_numbers
from teasim.common.arrays import Array
from teasim.pool import Span


@dataclass(frozen=True)
class _Step:
    """A segment with what is known of it."""

    label: int
    """Sub-task, 0..T-1."""
    span: Span
    """Where it is."""
    row: int | None
    """Its number in the demonstration; None for a step that is only supposed."""


def legal_evidence(evidence: Evidence, rules: Rules) -> Evidence:
    """Return the evidence without what the rules call legal; the same where they call nothing so.

    Args:
        evidence: segments without features.
        rules: the rules of the user.
    """
    if not (rules.any_order or rules.legal or rules.optional):
        return evidence
    names = evidence.subtasks
    demos = [
        [_Step(label, span, row) for row, (label, span) in enumerate(zip(*demo, strict=True))]
        for demo in zip(evidence.labels, evidence.segments, strict=True)
    ]
    for label in rules.optional:
        demos = _filled(demos, label, names)
    for pair in rules.legal:
        demos = _in_usual_order(demos, pair, len(names))
    if rules.any_order:
        demos = _sorted(demos, rules, len(names))
    return _rebuilt(evidence, demos)


def _labels(demos: Sequence[Sequence[_Step]]) -> list[list[int]]:
    return [[step.label for step in demo] for demo in demos]


def _order(demos: Sequence[Sequence[_Step]], n_subtasks: int) -> Array:
    return usual_order(_labels(demos), np.ones(len(demos)), n_subtasks)


def _filled(demos: list[list[_Step]], label: int, names: Sequence[str]) -> list[list[_Step]]:
    """Suppose a step where it is left out, at its usual place and of its usual length."""
    own = [step.span for demo in demos for step in demo if step.label == label]
    length = max(1, round(float(np.median([span.stop - span.start for span in own])))) if own else 1
    order = _order(demos, len(names))
    filled = []
    for demo in demos:
        steps = [step.label for step in demo]
        if label in steps:
            filled.append(demo)
            continue
        row = place_of(label, steps, order)
        start = demo[row].span.start if row < len(demo) else demo[-1].span.stop
        added = _Step(label, Supposed(names[label], start, start + length), None)
        filled.append([*demo[:row], added, *demo[row:]])
    return filled


def _in_usual_order(
    demos: list[list[_Step]], pair: tuple[int, int], n_subtasks: int
) -> list[list[_Step]]:
    """Where few do a before b, move one of the two as most others do."""
    first, second = pair
    does = [_does_before(demo, first, second) for demo in demos]
    others = [demo for demo in demos if _does_before(demo, second, first)]
    if sum(does) > len(others) or not others:
        return demos
    order = _order(others, n_subtasks)
    return [
        _moved(demo, pair, order) if legal else demo
        for demo, legal in zip(demos, does, strict=True)
    ]


def _does_before(demo: Sequence[_Step], first: int, second: int) -> bool:
    steps = [step.label for step in demo]
    both = first in steps and second in steps
    return both and steps.index(first) < steps.index(second)


def _moved(demo: list[_Step], pair: tuple[int, int], order: Array) -> list[_Step]:
    """Return the demonstration with the step of the pair moved that then fits the order better."""
    found = []
    for label in pair:
        rest = [step for step in demo if step.label != label]
        row = place_of(label, [step.label for step in rest], order)
        found.append([*rest[:row], *(step for step in demo if step.label == label), *rest[row:]])
    return min(found, key=lambda steps: (_disagreement(steps, order), _does_before(steps, *pair)))


def _disagreement(demo: Sequence[_Step], order: Array) -> float:
    labels = [step.label for step in demo]
    return sum(
        float(order[later, label])
        for row, label in enumerate(labels)
        for later in labels[row + 1 :]
    )


def _sorted(demos: list[list[_Step]], rules: Rules, n_subtasks: int) -> list[list[_Step]]:
    """Put the steps of every demonstration into one order that breaks no rule."""
    order = _order(demos, n_subtasks)
    left = list(range(n_subtasks))
    rank: dict[int, int] = {}
    while left:
        ready = [a for a in left if not rules.before[left, a].any()]
        chosen = max(ready, key=lambda a: float(order[a, left].sum()))
        rank[chosen] = len(rank)
        left.remove(chosen)
    return [sorted(demo, key=lambda step: rank[step.label]) for demo in demos]


def _rebuilt(evidence: Evidence, demos: Sequence[Sequence[_Step]]) -> Evidence:
    spans = tuple(tuple(step.span for step in demo) for demo in demos)
    assert label_numbers(spans, evidence.subtasks) == _labels(demos)
    return replace(
        evidence,
        segments=spans,
        ineffective=_arranged(evidence.ineffective, demos, nothing=0.0),
        reliability=_arranged(evidence.reliability, demos, nothing=None),
    )


def _arranged(
    known: Sequence[Array] | None, demos: Sequence[Sequence[_Step]], nothing: float | None
) -> list[Array] | None:
    """Return what is known per segment (q,) in the new order; supposed steps get `nothing`.

    None stands for the mean of the demonstration.
    """
    if known is None:
        return None
    return [
        np.array(
            [
                (float(own.mean()) if nothing is None else nothing)
                if step.row is None
                else float(own[step.row])
                for step in demo
            ]
        )
        for own, demo in zip(known, demos, strict=True)
    ]
