"""What every environment reports of an episode: `info`, and the violations it can name."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from teasim.constants import SUBTASKS
from teasim.task.recipes import allowed_next, next_correct
from teasim.task.scoring import VIOLATION_KINDS, VIOLATIONS, Verdict

VIOLATION_METADATA: Mapping[str, Any] = MappingProxyType(
    {"violations": dict(VIOLATIONS), "violation_kinds": dict(VIOLATION_KINDS)}
)
"""Part of the metadata of every environment, see `teasim.envs.base.StationEnv`."""


def report(done: tuple[str, ...], verdict: Verdict, time: float) -> dict[str, Any]:
    """Return `info` after the sub-tasks `done`, at `time` [s]."""
    following = next_correct(done)
    return {
        "success": verdict.success,
        "is_success": verdict.success,
        "subtasks": SUBTASKS,
        "subtasks_done": done,
        "correct_action": -1 if following is None else SUBTASKS.index(following),
        "allowed_actions": tuple(SUBTASKS.index(name) for name in allowed_next(done)),
        "violations": verdict.violations,
        "unsafe": verdict.unsafe,
        "time": np.float64(time),
    }
