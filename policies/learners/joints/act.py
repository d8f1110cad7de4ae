"""Action chunks: residual networks plan the next joint targets, and plans of every step are joined.

After ACT (Zhao et al., "Learning Fine-Grained Bimanual Manipulation with Low-Cost Hardware", RSS
2023): a chunk of targets per observation, an L1 loss, and temporal ensembling. Instead of a
transformer over pictures there is a residual network per sub-task over the state, and a network
that tells the sub-task, as in the options of hierarchical imitation (Le et al., ICML 2018).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from policies.data.motions import MotionSamples
from policies.learners.joints.chunk_policy import ChunkPolicy
from policies.learners.joints.cloning import clone_chunks
from policies.learners.joints.descent import PlanConfig
from policies.learners.joints.steps.rows import prepare


@dataclass(frozen=True)
class ACTConfig(PlanConfig):
    """Settings of action chunks."""


class ACT:
    """minimise over theta: mean over sub-tasks of sum_i w_i |a_i..i+K - plan_theta(s_i)|_1."""

    policy_: ChunkPolicy
    history_: tuple[float, ...]

    def __init__(self, config: ACTConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or ACTConfig()

    def fit(self, samples: MotionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        rows = prepare(samples, weights, timed=True)
        subtasks = int(rows.subtasks.max()) + 1
        network, self.history_ = clone_chunks(rows, subtasks, self.config)
        self.policy_ = ChunkPolicy(network, samples.spec, samples.action_names)
        return self
