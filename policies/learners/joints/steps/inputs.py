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
QUATERNION = ("_qw", "_qx", "_qy", "_qz")
POSITION = ("_x", "_y", "_z")
PARTS = (*POSITION, *QUATERNION)
"""Ends of the names of the numbers of a pose."""


class StateInputs:
    """Turns states (n, S) into inputs (n, I) by the names of their numbers.

    Poses in the world are left out of things that are also seen in the frame of a hand: they stay
    the same while nothing touches the thing, so a network would tell by them which demonstration
    it sees, and learn it by heart.
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Find poses among the S `names`: X_qw to X_qz, and X_x to X_z if X is relative."""
        places = {name: place for place, name in enumerate(names)}
        seen_by_hand = {name.partition(RELATIVE)[0] for name in names if RELATIVE in name}
        for thing in seen_by_hand:
            for part in PARTS:
                places.pop(thing + part, None)
        turns = _groups(places, QUATERNION)
        near = [group for body, group in _groups(places, POSITION).items() if RELATIVE in body]
        self._turns = np.array(list(turns.values()), dtype=np.int64).reshape(-1, 4)
        self._near = np.array(near, dtype=np.int64).reshape(-1)
        self._plain = np.setdiff1d(list(places.values()), self._turns).astype(np.int64)
        sources = [*self._plain, *np.repeat(self._turns[:, 0], 6), *self._near]
        self.sources = tuple(names[place] for place in sources)
        """Name of the number, or of the first number of the quaternion, behind each input."""

    @property
    def count(self) -> int:
        """I, number of inputs."""
        return len(self.sources)

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
