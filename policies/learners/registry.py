"""The learners by name; a new learner is one row here and one file beside this one."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from policies.learners.bc import BC, BCConfig
from policies.learners.bc_rnn import BCRNN, BCRNNConfig
from policies.learners.bcnd import BCND, BCNDConfig
from policies.learners.demodice import DemoDICE, DemoDICEConfig
from policies.learners.joints.act import ACT, ACTConfig
from policies.learners.joints.bc import JointBC, JointBCConfig
from policies.learners.joints.bc_rnn import JointBCRNN, JointBCRNNConfig
from policies.learners.nearest import Nearest, NearestConfig
from policies.learners.r_maxent import RMaxEnt, RMaxEntConfig
from teasim.common.errors import ConfigError
from teasim.common.registry import named

EXPERTS = "experts"
"""Need of a learner that must be told which demonstrations are known to be good."""
LOG = "log"
"""Need of a learner whose pool must log joint positions and targets."""
GIVEN_ELSEWHERE = ("seed", "experts")
"""Settings that have an option of their own (--seed, --expert) and are not a learner's options."""


class Learner(Protocol):
    """Turns weighted samples into a policy; learned attributes end in an underscore.

    At the sub-task level the samples are `DecisionSamples` and the policy is a `SubtaskPolicy`, at
    the joint level `MotionSamples` and a `MotionPolicy`.
    """

    config: Any
    """Frozen settings; `fit` never changes them."""
    policy_: Any
    """The learned policy."""
    history_: Sequence[float]
    """Training loss of each step [nat per decision; spreads of a joint target]."""

    def fit(self, samples: Any, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration of the pool, (D,)."""


@dataclass(frozen=True)
class LearnerKind:
    """A learner, its settings, and what it needs; every settings class has a field `seed`."""

    learner: type[Any]
    """Class with the method `fit`."""
    config: type[Any]
    """Dataclass of its settings."""
    levels: tuple[str, ...]
    """Levels at which it learns: `subtask` (the next sub-task), `joint` (the joint targets)."""
    needs: tuple[str, ...] = ()
    """Needs besides weighted samples: `experts` (`config` then has a field `experts`: places
    in the pool of demonstrations known to be good), `log` (a joint log in the pool)."""

    @property
    def options(self) -> tuple[str, ...]:
        """Names of the settings that `--set` and the tables of an ablation take."""
        names = [field.name for field in fields(self.config)]
        return tuple(name for name in names if name not in GIVEN_ELSEWHERE)

    def make(self, **settings: Any) -> Learner:
        """Build the learner with `settings` of its config."""
        made: Learner = self.learner(self.config(**settings))
        return made


LEARNERS = {
    "act": LearnerKind(ACT, ACTConfig, ("joint",), needs=(LOG,)),
    "bc": LearnerKind(BC, BCConfig, ("subtask",)),
    "bc-rnn": LearnerKind(BCRNN, BCRNNConfig, ("subtask",)),
    "bcnd": LearnerKind(BCND, BCNDConfig, ("subtask",)),
    "demodice": LearnerKind(DemoDICE, DemoDICEConfig, ("subtask",), needs=(EXPERTS,)),
    "nearest": LearnerKind(Nearest, NearestConfig, ("joint",), needs=(LOG,)),
    "r-maxent": LearnerKind(RMaxEnt, RMaxEntConfig, ("subtask",)),
}

AT_JOINTS = {
    "bc": LearnerKind(JointBC, JointBCConfig, ("joint",), needs=(LOG,)),
    "bc-rnn": LearnerKind(JointBCRNN, JointBCRNNConfig, ("joint",), needs=(LOG,)),
}
"""What is done at the joint level by learners that have a row for sub-tasks above."""


def find_learner(name: str, level: str) -> LearnerKind:
    """Return the learner called `name` if it learns at `level`.

    Raises:
        ConfigError: there is no such learner, or it does not learn at that level.
    """
    kind = named("learner", LEARNERS, name)
    if level == "joint":
        kind = AT_JOINTS.get(name, kind)
    if level not in kind.levels:
        raise ConfigError(
            f"The learner '{name}' has no level '{level}'; choose {', '.join(kind.levels)}."
        )
    return kind


def learners_that_need(need: str) -> list[str]:
    """Names of the learners with `need` in their row."""
    return [name for name, kind in LEARNERS.items() if need in kind.needs]
