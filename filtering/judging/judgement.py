"""The result of judging the demonstrations of a pool, whatever they were judged by."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from filtering.judging.explain import NO_STEP, Finding
from filtering.judging.thresholds import Grouping
from teasim.common.arrays import Array

if TYPE_CHECKING:
    from filtering.judging.decision.decide import PoolDecision


@dataclass(frozen=True)
class Judgement:
    """The result of judging the demonstrations of a pool."""

    losses: Array
    """(D,) surprise [nats], higher is worse."""
    weights: Array
    """(D,) in [0, 1], 1 for a usual demonstration."""
    grouping: Grouping
    """Groups and threshold on the weights."""
    trust: Array
    """(D,) how much each demonstration shapes the norm, in [0, 1]."""
    findings: tuple[tuple[Finding, ...], ...]
    """Per demonstration its unusual places, the most important one first."""
    objective: float | None = None
    """Value of equation 3 [nats per step]; None for another score."""
    reasons: tuple[str, ...] | None = None
    """Per demonstration a sentence on the most important finding; None where the findings name
    sub-tasks and `explain` writes it."""
    decision: "PoolDecision | None" = None
    """The learned decision; None where clusters decided."""
    probabilities: Array | None = None
    """(D,) probability that each demonstration is incorrect, with the rules of the user; None
    where it follows from the losses by `probability_incorrect`."""
    otherwise: str = NO_STEP
    """Sentence about a demonstration without findings."""
