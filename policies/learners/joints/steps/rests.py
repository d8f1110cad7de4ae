"""Rests of a demonstration that a policy without a clock could never leave again.

A demonstrator pauses before a sub-task. What is seen does not change meanwhile, so a network that
predicts the usual target rests for ever. Steps of rest teach nothing else and are left out, as in
the data of OpenVLA (Kim et al., 2024, appendix on LIBERO). A step is no rest if anything moves
besides the arms, as while a vessel runs empty, or soon after a gripper was commanded.
"""

import numpy as np
from numpy.typing import NDArray

from policies.learners.joints.steps.switches import steps_since_change

STILL = 1e-4
"""Numbers of the state that change by less in a control step do not move [their unit]."""
PRESSING = 15
"""Control steps after a switch has changed in which waiting has a purpose."""


def restless(
    seen: NDArray[np.float32], targets: NDArray[np.float32], switches: list[int], world: list[int]
) -> NDArray[np.bool_]:
    """Return which of the n steps of a demonstration are no rests, (n,).

    Args:
        seen: States (n, S).
        targets: Joint targets (n, J).
        switches: Places of the targets that switch.
        world: Places of the numbers of the state that do not depend on the arms.
    """
    commanded = np.abs(np.diff(targets, axis=0, prepend=np.inf)).max(axis=1) > 0
    moved = np.abs(np.diff(seen[:, world], axis=0, append=seen[-1:, world]))
    happening = (moved > STILL).any(axis=1)
    pressing = (steps_since_change(targets[:, switches]) <= PRESSING).any(axis=1)
    return np.asarray(commanded | happening | pressing)
