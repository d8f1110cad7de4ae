"""The numbers of the state as a network of joint targets is given them.

Quaternions become the first two columns of their rotation matrix, which are continuous (Zhou et
al., "On the Continuity of Rotation Representations in Neural Networks", CVPR 2019). Positions
relative to a hand are given a second time, magnified near the hand, where millimetres matter.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

NEAR = 0.02
"""Distance at which the magnified position of a thing in a hand's frame saturates [m]."""
RELATIVE = "_in_"
"""Part of the name of a pose that is relative to another body."""
_QUATERNION = ("_qw", "_qx", "_qy", "_qz")
_POSITION = ("_x", "_y", "_z")


class StateInputs:
    """Turns states (n, S) into inputs (n, I) by the names of their numbers."""

    def __init__(self, names: Sequence[str]) -> None:
        """Find poses among the S `names`: X_qw to X_qz, and X_x to X_z if X is relative."""
        places = {name: place for place, name in enumerate(names)}
        turns = _groups(places, _QUATERNION)
        near = [group for body, group in _groups(places, _POSITION).items() if RELATIVE in body]
        self._turns = np.array(list(turns.values()), dtype=np.int64).reshape(-1, 4)
        self._near = np.array(near, dtype=np.int64).reshape(-1)
        self._plain = np.setdiff1d(np.arange(len(names)), self._turns)
        self.count = len(self._plain) + 6 * len(self._turns) + len(self._near)
        """I, number of inputs."""

    def __call__(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the inputs (n, I) float32 of states (n, S)."""
        turned = _columns(seen[:, self._turns]).reshape(len(seen), -1)
        near = np.tanh(seen[:, self._near] / NEAR)
        return np.hstack([seen[:, self._plain], turned, near]).astype(np.float32)


def _groups(places: dict[str, int], parts: Sequence[str]) -> dict[str, list[int]]:
    """Return the places of all names X + part by X, where all of them occur."""
    bodies = [name.removesuffix(parts[0]) for name in places if name.endswith(parts[0])]
    wanted = {body: [body + part for part in parts] for body in bodies}
    return {
        body: [places[name] for name in names]
        for body, names in wanted.items()
        if all(name in places for name in names)
    }


def _columns(quaternions: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the first two columns (..., 6) of the rotations of quaternions (..., 4), wxyz."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    first = (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y))
    second = (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x))
    return np.stack([*first, *second], axis=-1)
