"""Settings by which demonstrations are judged; light, so that `--help` needs no SciPy."""

import math
from dataclasses import dataclass
from typing import Annotated

from tyro.constructors import PrimitiveConstructorSpec

from filtering.judging.norm.precedence import Pairs, read_precedence
from teasim.common.errors import ConfigError

PRECEDENCE_FILE = PrimitiveConstructorSpec(
    nargs=1,
    metavar="FILE",
    instance_from_str=lambda words: read_precedence(words[0]),
    is_instance=lambda value: isinstance(value, tuple),
    str_from_instance=lambda pairs: [str(list(pairs))],
)
"""How the command line reads precedence: from a file."""

DECISIONS = ("learned", "clusters")
"""Ways to decide who is flagged."""


@dataclass(frozen=True)
class JudgingConfig:
    """How the segments of a pool become weights and groups."""

    score: str = "auto"
    """What demonstrations are judged by: moments (where each moment of a video has its counterpart
    in the others; needs no sub-tasks), norm (omissions, order and next steps, compared with what
    most of the pool does), combined (the graver verdict of these two) or equation3 (the next-step
    model of the paper). auto: combined for videos alone, or else norm."""
    groups: str = "auto"
    """Number of groups: auto (kept; with the score norm also out of order and steps left out), 1
    (nothing is flagged), 2 or 3."""
    threshold: float | str = "auto"
    """Weight below which a demonstration is flagged: a number between 0 and 1, auto (the rule of
    the score), or the mid-points between groups of weights found by kmeans, gmm or minibatch."""
    decision: str = "clusters"
    """How losses become flags: clusters (a cut between clusters of the losses), or learned (the
    probability of being incorrect, given the whole pool). Only clusters are used where groups,
    threshold, tolerance or precedence are given, and for the score equation3."""
    cost: float = 2.0
    """False alarms that a miss is worth: the learned decision flags demonstrations that are
    incorrect with a probability above 1 / (1 + cost)."""
    tolerance: float = 0.0
    """Tolerance for behaviour that a minority shares, from 0 to below 1; 0.2 keeps legal orders
    that a few demonstrations share. For the score norm."""
    precedence: Annotated[Pairs, PRECEDENCE_FILE] = ()
    """File with lines 'a before b', or a JSON list of pairs [a, b]: the only rules of order that
    count. For the score norm."""
    solver: str = "annealed"
    """Solver of equation 3: annealed, alternating, exact (at most 24 different demonstrations) or
    published (SLSQP of SciPy, without a ridge)."""
    trusted_share: float = 0.5
    """M / D, share of the demonstrations that equation 3 trusts, between 0 and 1."""
    ridge: float = 0.01
    """Strength of the ridge penalty on lambda of equation 3 [nats per unit squared]."""

    def __post_init__(self) -> None:
        """Refuse numbers out of range and settings that exclude each other.

        Raises:
            ConfigError: in one sentence, with the choices.
        """
        if not 0.0 <= self.tolerance < 1.0:
            raise ConfigError(f"tolerance is {self.tolerance}; choose a share from 0 to below 1.")
        if self.decision not in DECISIONS:
            raise ConfigError(
                f"Unknown decision '{self.decision}'; choose {' or '.join(DECISIONS)}."
            )
        if not 0.0 < self.cost < math.inf:
            raise ConfigError(f"cost is {self.cost}; choose a number above 0.")
        if not 0.0 < self.trusted_share < 1.0:
            raise ConfigError(
                f"trusted_share is {self.trusted_share}; choose a share between 0 and 1."
            )
        if not 0.0 < self.ridge < math.inf:
            raise ConfigError(f"ridge is {self.ridge}; choose a number above 0.")
        if self.score not in ("auto", "norm") and (self.precedence or self.tolerance):
            raise ConfigError(
                f"The score '{self.score}' takes neither precedence nor tolerance; choose norm."
            )
        if not isinstance(self.threshold, str):
            self._check_number(self.threshold)

    @property
    def learns(self) -> bool:
        """Whether the learned decision is used."""
        plain = self.groups == "auto" and self.threshold == "auto"
        exact = not self.tolerance and not self.precedence
        return self.decision == "learned" and self.score in ("auto", "norm") and plain and exact

    def _check_number(self, threshold: float) -> None:
        if not 0.0 < threshold < 1.0:
            raise ConfigError(
                f"threshold is {threshold}; choose a weight between 0 and 1, or the name of a rule."
            )
        if self.groups not in ("auto", "2"):
            raise ConfigError(
                f"The threshold {threshold} makes 2 groups, not {self.groups}; leave out groups."
            )
