"""Counter of the forbidden contacts that begin."""

from itertools import combinations_with_replacement

import mujoco
import numpy as np

from teasim.world.monitor import is_forbidden, roles
from teasim.world.simulation import Simulation
from teasim.world.state import Saved


class CollisionCounter(Saved):
    """Counts forbidden contacts of a simulation after every update.

    A contact begins when a pair of roles, for example the right arm and the table, touches and did
    not touch at the update before, whatever the number of shapes that touch.
    """

    SAVED = ("begun", "touching")

    def __init__(self, simulation: Simulation) -> None:
        self._data = simulation.data
        self._kinds = forbidden_kinds(simulation.model).ravel()
        self._row = simulation.model.ngeom
        self.reset()
        simulation.observers.append(self._look)

    def reset(self) -> None:
        """Set the count to zero."""
        self.begun = 0
        """Forbidden contacts that began since the last reset."""
        self.touching: frozenset[int] = frozenset()
        """Present forbidden contacts, numbered by `forbidden_kinds`."""

    def _look(self) -> None:
        touching: frozenset[int] = frozenset()
        if self._data.ncon:
            pairs = self._data.contact.geom
            kinds = self._kinds[self._row * pairs[:, 0] + pairs[:, 1]]
            if np.count_nonzero(kinds):
                kinds *= self._data.contact.dist < 0
                touching = frozenset(kinds.tolist()) - {0}
        self.begun += len(touching - self.touching)
        self.touching = touching


def forbidden_kinds(model: mujoco.MjModel) -> np.ndarray:
    """Return the number of the forbidden pair of roles of any two shapes, or 0 (ngeom, ngeom)."""
    names = roles(model)
    distinct = sorted(set(names))
    kinds = np.zeros((len(distinct), len(distinct)), np.int64)
    for number, (i, j) in enumerate(combinations_with_replacement(range(len(distinct)), 2), 1):
        if is_forbidden((distinct[i], distinct[j])):
            kinds[i, j] = kinds[j, i] = number
    numbers = [distinct.index(name) for name in names]
    return kinds[np.ix_(numbers, numbers)]
