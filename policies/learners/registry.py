"""The learners by name; a new learner is one line here and one file beside this one."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from policies.learners.bc import BC, BCConfig
from policies.learners.bc_rnn import BCRNN, BCRNNConfig
from policies.learners.bcnd import BCND, BCNDConfig
from policies.learners.demodice import DemoDICE, DemoDICEConfig
from policies.learners.nearest import Nearest, NearestConfig
from policies.learners.r_maxent import RMaxEnt, RMaxEntConfig
from teasim.common.errors import ConfigError
from teasim.common.registry import named


class Learner(Protocol):
    """Turns weighted samples into a policy; learned attributes end in an underscore.

    At the sub-task level the samples are `base.DecisionSamples` and the policy a `SubtaskPolicy`,
    at the joint level `motions.MotionSamples` and a `MotionPolicy`.
    """

    config: Any
    """Frozen settings; `fit` never changes them."""
    policy_: Any
    """What was learned."""
    history_: Sequence[float]
    """Training loss of each step [nat per decision; spreads of a joint target]."""

    def fit(self, samples: Any, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration of the pool, (D,)."""


@dataclass(frozen=True)
class LearnerKind:
    """A learner and the settings it takes; every settings class has a field `seed`."""

    learner: type[Any]
    config: type[Any]
    levels: tuple[str, ...]
    """Levels it learns at: `subtask` (which sub-task comes next), `joint` (where the joints go)."""

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
    "nearest": LearnerKind(Nearest, NearestConfig, ("joint",)),
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
