"""Behaviour cloning of joint targets: one residual network from the state to the next target."""

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
class JointBCConfig(PlanConfig):
    """Settings of behaviour cloning of joint targets."""

    chunk: int = 1
    """K, control steps (0.1 s) planned ahead."""
    batch: int = 256
    """Control steps in a gradient step."""


class JointBC:
    """minimise over theta: sum_i w_i |a_i - plan_theta(s_i)|_1, with sum_i w_i = 1.

    There are neither sub-tasks nor a memory: the next target depends on the state alone.
    """

    policy_: ChunkPolicy
    history_: tuple[float, ...]

    def __init__(self, config: JointBCConfig | None = None) -> None:
        """Keep the settings; `fit` does the work and never changes them."""
        self.config = config or JointBCConfig()

    def fit(self, samples: MotionSamples, weights: NDArray[np.float64]) -> Self:
        """Learn from `samples` with one weight per demonstration, (D,).

        Raises:
            ConfigError: the weights do not fit the samples, or all are 0.
        """
        rows = prepare(samples, weights, timed=False)
        network, self.history_ = clone_chunks(rows, 1, self.config)
        self.policy_ = ChunkPolicy(network, samples.spec, samples.action_names)
        return self
