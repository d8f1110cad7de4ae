"""Videos as they are seen from the viewpoint of a reference."""

import numpy as np
from numpy.typing import NDArray

from filtering.moments.counterparts import Counterparts
from filtering.moments.effects.changes import (
    LEAST_CHANGE,
    States,
    change_about,
    lasting_sizes,
    later_about,
)
from filtering.moments.effects.offsets import offset_between, shifted_back

STRIDE = 4
"""Every fourth moment is looked at for what changes where."""
ENDS = 20
"""First and last moments of a video, 4 s, whose medians tell what was changed for good: arms lie
where it suits the one who acts."""


class Viewpoint:
    """The viewpoint of one reference.

    What is in its picture may lie elsewhere as a whole in another video, because the camera or the
    one thing that it looks at stood elsewhere. It is told by what changes for good.
    """

    def __init__(self, found: Counterparts, row: int, reference: States) -> None:
        """Look at what changes in the reference of a row of `found`."""
        self.row = row
        self._found, self._number = found, found.references[row]
        self._changes = self._changes_of(self._number, reference)

    def placed(self, d: int, states: States) -> States:
        """Return the states of video d shifted so that changes lie where the reference has them."""
        if d == self._number:
            return states
        offset = offset_between(self._changes, self._changes_of(d, states))
        return shifted_back(states, offset)

    def _changes_of(self, d: int, states: States) -> NDArray[np.float64]:
        """Return (T, H, W): how much changes, and lasts, at the counterparts of the moments."""
        place = (self._found, self.row, d)
        altogether = np.median(states[-ENDS:], axis=0) - np.median(states[:ENDS], axis=0)
        changed = np.linalg.norm(altogether, axis=-1) >= LEAST_CHANGE
        return np.stack(
            [
                changed
                * lasting_sizes(
                    change_about(states, *place, moment), later_about(states, *place, moment)
                )
                for moment in range(0, self._found.lengths[self._number], STRIDE)
            ]
        )
