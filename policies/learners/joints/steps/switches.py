"""Targets that switch between few values, as those of grippers do, and the time since they did.

A grasp needs time to close, and nothing in the state says how long a gripper has been pressing.
"""

import numpy as np
from numpy.typing import NDArray

MOST_VALUES = 16
"""A target with more different values than this is no switch."""
ROWS_PER_VALUE = 100
"""Least number of control steps per value of a switch: in a short log every target has few."""
OLDEST = 60
"""The time since a change is counted up to this [control steps]."""
SPANS = (3.0, 10.0, 40.0)
"""Time constants with which a change fades from the inputs [control steps]."""


def switch_values(targets: NDArray[np.float32]) -> dict[int, NDArray[np.float32]]:
    """Return the values of each target (n, J) that is a switch, ascending, by its place."""
    most = min(MOST_VALUES, len(targets) // ROWS_PER_VALUE)
    values = {place: np.unique(column) for place, column in enumerate(targets.T)}
    return {place: found for place, found in values.items() if 1 < len(found) <= most}


def steps_since_change(commands: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return how long ago each switch changed (n, G), seen before each step of a demonstration.

    Args:
        commands: Targets of G switches in n control steps of one demonstration, (n, G).
    """
    ages = np.full(commands.shape, OLDEST, dtype=np.float32)
    for step in range(1, len(commands)):
        changed = commands[step - 1] != commands[step - 2] if step > 1 else False
        ages[step] = np.where(changed, 1, np.minimum(ages[step - 1] + 1, OLDEST))
    return ages


def age_inputs(ages: NDArray[np.floating]) -> NDArray[np.float32]:
    """Return inputs (n, 3 G) that fade from 1 to 0 with the steps since a change, (n, G)."""
    faded = [np.exp(-ages / span) for span in SPANS]
    return np.hstack(faded).astype(np.float32)
