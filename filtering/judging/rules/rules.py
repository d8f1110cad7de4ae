"""The rules of a user about a pool, with sub-tasks as numbers, and who breaks them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from filtering.judging.explain import Finding
from filtering.judging.places import Places, place_of, usual_order
from filtering.judging.rules.order import BETWEEN, Pairs, number_of, numbered, precedence_graph

CRITICAL_RISK = 0.95
"""Probability that leaving out a critical step alone makes a demonstration incorrect. A round
number of the user's word against a segmenter that misses one step in twenty."""
CRITICAL_NATS = math.log(CRITICAL_RISK / (1 - CRITICAL_RISK))
"""What leaving out a critical step adds to the loss: the log-odds of that probability [nats]."""
BROKEN_NATS = 20.0
"""What a broken rule of order adds to the loss: as much as the strongest evidence that the default
score knows, `LARGEST_RATIO` of `norm_score` [nats]."""


class Told(Protocol):
    """Settings that hold rules, with the names that the user wrote."""

    @property
    def precedence(self) -> Pairs:
        """Pairs (a, b): a has to come before b."""

    @property
    def keep(self) -> Pairs:
        """Pairs (a, b): doing a before b is legal."""

    @property
    def optional(self) -> tuple[str, ...]:
        """Sub-tasks that may be left out."""

    @property
    def critical(self) -> tuple[str, ...]:
        """Sub-tasks that must not be left out."""


@dataclass(frozen=True)
class Rules:
    """What a user says about T sub-tasks."""

    before: NDArray[np.bool_]
    """(T, T) True where a has to come before b."""
    legal: tuple[tuple[int, int], ...] = ()
    """Pairs (a, b): doing a before b is legal, even if few do."""
    optional: tuple[int, ...] = ()
    """Sub-tasks that may be left out."""
    critical: tuple[int, ...] = ()
    """Sub-tasks that must not be left out."""

    @property
    def any_order(self) -> bool:
        """Whether only the rules say which orders are wrong."""
        return bool(self.before.any())


@dataclass(frozen=True)
class Charge:
    """A rule that a demonstration breaks."""

    finding: Finding
    """Where and how."""
    risk: float
    """Probability that this alone makes the demonstration incorrect."""


def rules_of(told: Told, subtasks: Sequence[str]) -> Rules:
    """Return the rules of the settings for a pool of some sub-tasks.

    Raises:
        ConfigError: a setting names an unknown sub-task, or the precedence has a cycle.
    """
    return Rules(
        precedence_graph(told.precedence, subtasks),
        tuple(numbered(told.keep, subtasks, "keep")),
        tuple(number_of(name, subtasks, "optional") for name in told.optional),
        tuple(number_of(name, subtasks, "critical") for name in told.critical),
    )


def charges_of(rules: Rules, labels: Sequence[Sequence[int]], places: Places) -> list[list[Charge]]:
    """Return per demonstration the rules that it breaks, the first broken one first.

    A rule of order is about demonstrations that do both steps: it is broken where the second one
    begins before the first one has begun.

    Args:
        rules: the rules.
        labels: per demonstration its q sub-task labels, 0..T-1.
        places: its segments and their names.
    """
    order = usual_order(labels, np.ones(len(labels)), len(places.subtasks))
    done = {label for steps in labels for label in steps}
    found = []
    for demo, steps in enumerate(labels):
        charges = _disorder(rules, list(steps), places, demo)
        for label in rules.critical:
            if label not in steps:
                row = place_of(label, steps, order)
                finding = places.finding(demo, row, label, CRITICAL_NATS)
                finding = replace(finding, rule=f"'{places.subtasks[label]}' is critical")
                if label not in done:  # then it has no usual place
                    finding = replace(finding, after=None, seen=None)
                charges.append(Charge(finding, CRITICAL_RISK))
        found.append(charges)
    return found


def _disorder(rules: Rules, steps: list[int], places: Places, demo: int) -> list[Charge]:
    found = []
    for a, b in np.argwhere(rules.before).tolist():
        if a in steps and b in steps and steps.index(b) < steps.index(a):
            late, early = (places.segments[demo][steps.index(label)] for label in (a, b))
            finding = Finding(
                expected=late.subtask,
                seen=early.subtask,
                after=None,
                frame=early.start,
                missing=False,
                surprise=BROKEN_NATS,
                came=late,
                rule=f"{late.subtask}{BETWEEN}{early.subtask}",
            )
            found.append(Charge(finding, 1.0))
    return sorted(found, key=lambda charge: charge.finding.frame)
