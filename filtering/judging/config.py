"""Settings by which demonstrations are judged; light, so that `--help` needs no SciPy."""

import math
from dataclasses import dataclass
from typing import Annotated

import tyro
from tyro.constructors import PrimitiveConstructorSpec

from filtering.judging.rules.order import BETWEEN, Pairs, check_pairs, pairs_of
from teasim.common.errors import ConfigError

PAIRS = PrimitiveConstructorSpec(
    nargs="*",
    metavar="RULE",
    instance_from_str=pairs_of,
    is_instance=lambda value: isinstance(value, tuple),
    str_from_instance=lambda pairs: [BETWEEN.join(pair) for pair in pairs],
)
"""How the command line reads pairs of sub-tasks: 'a before b', or a file."""
SubtaskPairs = Annotated[Pairs, PAIRS]
SubtaskNames = Annotated[tuple[str, ...], tyro.conf.arg(metavar="SUBTASK")]

FOR_NORM = ("precedence", "keep", "optional", "critical", "tolerance")
"""Settings that only the score norm takes."""
JUDGED_BY = ("auto", "w", "leave-one-out")
"""What can be made of equation 3."""
WITHOUT_STEPS = {
    "moments": "judges without sub-tasks and ",
    "combined": "judges by moments too, which know no sub-tasks, and ",
}
"""Why a score does not take them."""
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
    """Number of groups: auto (kept; also out of order, steps left out, extra steps, which clusters
    of sub-tasks do not find, and breaks a rule), 1 (nothing is flagged), 2 or 3."""
    threshold: float | str = "auto"
    """Weight below which a demonstration is flagged: a number between 0 and 1, auto (the rule of
    the score), or the mid-points between groups of weights found by kmeans, gmm or minibatch."""
    decision: str = "auto"
    """How the score norm decides who is flagged: learned (by the probability of being incorrect,
    given the whole pool), or clusters (by a cut between clusters of the losses). auto: learned, but
    clusters in the score combined. Where groups, threshold or tolerance are given, and for the
    score equation3, only clusters are used."""
    cost: float = 2.0
    """False alarms that a miss is worth: the learned decision flags demonstrations that are
    incorrect with a probability above 1 / (1 + cost)."""
    tolerance: float = 0.0
    """Tolerance for behaviour that a minority shares, from 0 to below 1; 0.2 keeps legal orders
    that a few demonstrations share. For the score norm."""
    precedence: SubtaskPairs = ()
    """Rules 'a before b', in words, in a file with such lines, or in a JSON list of pairs [a, b].
    Demonstrations that break one are flagged; no other order is wrong. For the score norm."""
    keep: SubtaskPairs = ()
    """Orders 'a before b' that are legal, even if few demonstrations show them; written like
    precedence. For the score norm."""
    optional: SubtaskNames = ()
    """Sub-tasks that may be left out. For the score norm."""
    critical: SubtaskNames = ()
    """Sub-tasks that must not be left out: those who do are flagged. For the score norm."""
    solver: str = "annealed"
    """Solver of equation 3: annealed, alternating, exact (at most 24 different demonstrations) or
    published (SLSQP of SciPy, without a ridge)."""
    judged_by: str = "auto"
    """What equation 3 says of a demonstration: w (the weight that the solver gives it, as
    published), or leave-one-out (how surprising it is to models of the others). auto: w for the
    solver published, leave-one-out for the others."""
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
        if self.decision not in ("auto", *DECISIONS):
            raise ConfigError(
                f"Unknown decision '{self.decision}'; choose auto, {' or '.join(DECISIONS)}."
            )
        if self.judged_by not in JUDGED_BY:
            raise ConfigError(f"judged_by is '{self.judged_by}'; choose {', '.join(JUDGED_BY)}.")
        if not 0.0 < self.cost < math.inf:
            raise ConfigError(f"cost is {self.cost}; choose a number above 0.")
        if not 0.0 < self.trusted_share < 1.0:
            raise ConfigError(
                f"trusted_share is {self.trusted_share}; choose a share between 0 and 1."
            )
        if not 0.0 < self.ridge < math.inf:
            raise ConfigError(f"ridge is {self.ridge}; choose a number above 0.")
        self._check_rules()
        if not isinstance(self.threshold, str):
            self._check_number(self.threshold)

    @property
    def learns(self) -> bool:
        """Whether the learned decision is used."""
        plain = self.groups == "auto" and self.threshold == "auto"
        named = self.score in ("auto", "norm")
        return self.decision != "clusters" and named and plain and not self.tolerance

    @property
    def by_w(self) -> bool:
        """Whether the weights of equation 3 themselves judge, as published."""
        return self.judged_by == "w" or (self.judged_by == "auto" and self.solver == "published")

    def _check_rules(self) -> None:
        for name in ("precedence", "keep"):
            check_pairs(getattr(self, name), name)
        both = sorted(set(self.optional) & set(self.critical))
        if both:
            raise ConfigError(f"'{both[0]}' cannot be both optional and critical; leave out one.")
        given = [name for name in FOR_NORM if getattr(self, name)]
        if not given or self.score in ("auto", "norm"):
            return
        raise ConfigError(
            f"The score '{self.score}' {WITHOUT_STEPS.get(self.score, '')}takes no {given[0]}; "
            "run 'teasim filter' again with '--score norm'."
        )

    def _check_number(self, threshold: float) -> None:
        if not 0.0 < threshold < 1.0:
            raise ConfigError(
                f"threshold is {threshold}; choose a weight between 0 and 1, or the name of a rule."
            )
        if self.groups not in ("auto", "2"):
            raise ConfigError(
                f"The threshold {threshold} makes 2 groups, not {self.groups}; leave out groups."
            )
