"""What both environments over sub-tasks share: their actions, and the terms of their reward."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from teasim.common.errors import ConfigError
from teasim.constants import SUBTASKS
from teasim.envs.rewards import Weights
from teasim.task.recipes import next_correct
from teasim.task.scoring import Verdict


@dataclass(frozen=True)
class DecisionWeights(Weights):
    """Weights of the terms of the reward, see `decision_terms`; by default only the goal counts."""

    success: float = 1.0
    """Weight of reaching the goal."""
    subtasks: float = 0.0
    """Weight of the share of sub-tasks that were completed for the first time."""
    reference: float = 0.0
    """Weight of the share of actions that were the next ones of Seq_1."""
    idle: float = 0.0
    """Weight of actions that complete no sub-task for the first time."""
    violations: float = 0.0
    """Weight of violations: breaks of the precedence and spills."""


def decision_terms(
    subtask: str, before: tuple[str, ...], after: tuple[str, ...], verdicts: tuple[Verdict, Verdict]
) -> dict[str, float]:
    """Return the terms of the reward of one action; all but `success` count in sevenths.

    * `success`: 1 when the goal is reached.
    * `subtasks`: share of the sub-tasks that were completed for the first time. It is a difference
      of a potential, so with a discount of 1 it does not change which policy is best (Ng, Harada &
      Russell, ICML 1999).
    * `reference`: a share for the reference's next sub-task, which the policy accuracy counts.
    * `idle`: minus a share for an action that completes no sub-task for the first time.
    * `violations`: minus a share for every new violation.

    Args:
        subtask: The sub-task that was chosen.
        before: Sub-tasks that were done before, in order.
        after: Sub-tasks that were done after it.
        verdicts: The verdicts before and after it.
    """
    count, completed = len(SUBTASKS), len(set(after)) - len(set(before))
    violated = len(verdicts[1].violations) - len(verdicts[0].violations)
    return {
        "success": float(verdicts[1].success),
        "subtasks": completed / count,
        "reference": float(subtask == next_correct(before)) / count,
        "idle": -float(completed == 0) / count,
        "violations": (0.0 - violated) / count,
    }


def subtask_of(action: Any) -> str:
    """Return the name of sub-task number `action`.

    Raises:
        ConfigError: there is no sub-task of that number.
    """
    number = np.asarray(action)
    if number.dtype.kind in "iu" and number.size == 1 and 0 <= number.item() < len(SUBTASKS):
        return SUBTASKS[number.item()]
    raise ConfigError(f"Unknown action {action!r}; choose a number from 0 to {len(SUBTASKS) - 1}.")


def check_max_actions(max_actions: int) -> int:
    """Return `max_actions`, the number of actions after which an episode is truncated.

    Raises:
        ConfigError: it is smaller than 1.
    """
    if max_actions < 1:
        raise ConfigError(f"max_actions is {max_actions}; choose 1 or more.")
    return max_actions
