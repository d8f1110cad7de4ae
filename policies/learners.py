"""The learners by name; a new learner is one line here and one file beside this one."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from policies.base import DecisionSamples
from policies.bc import BC, BCConfig
from policies.bc_rnn import BCRNN, BCRNNConfig
from policies.bcnd import BCND, BCNDConfig
from policies.demodice import DemoDICE, DemoDICEConfig
from policies.r_maxent import RMaxEnt, RMaxEntConfig
from policies.subtask_policy import SubtaskPolicy
from teasim.errors import ConfigError, named


class Learner(Protocol):
    """Turns weighted decisions into a policy; learned attributes end in an underscore."""

    config: Any
    """Frozen settings; `fit` never changes them."""
    policy_: SubtaskPolicy
    """What was learned."""
    history_: Sequence[float]
    """Training loss after each step [nat per decision]."""

    def fit(self, samples: DecisionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration of the pool, (D,)."""


@dataclass(frozen=True)
class LearnerKind:
    """A learner and the settings it takes; every settings class has a field `seed`."""

    learner: type[Any]
    config: type[Any]
    levels: tuple[str, ...]
    """Levels it learns at: `subtask` (which sub-task comes next)."""

    @property
    def takes_experts(self) -> bool:
        """Whether it has to be told of demonstrations that are known to be good."""
        return "experts" in {field.name for field in fields(self.config)}

    def make(self, **settings: Any) -> Learner:
        """Build the learner with `settings` of its config."""
        made: Learner = self.learner(self.config(**settings))
        return made


LEARNERS = {
    "bc": LearnerKind(BC, BCConfig, ("subtask",)),
    "bc-rnn": LearnerKind(BCRNN, BCRNNConfig, ("subtask",)),
    "bcnd": LearnerKind(BCND, BCNDConfig, ("subtask",)),
    "demodice": LearnerKind(DemoDICE, DemoDICEConfig, ("subtask",)),
    "r-maxent": LearnerKind(RMaxEnt, RMaxEntConfig, ("subtask",)),
}


def find_learner(name: str, level: str) -> LearnerKind:
    """Return the learner called `name` if it learns at `level`.

    Raises:
        ConfigError: no such learner, or not at that level.
    """
    kind = named("learner", LEARNERS, name)
    if level not in kind.levels:
        raise ConfigError(
            f"The learner '{name}' has no level '{level}'; choose {', '.join(kind.levels)}."
        )
    return kind
