"""What both hands see of the things: their own poses, and the poses of things in their frames.

As in robosuite, whose observations hold `robot0_eef_pos` and `cube_to_robot0_eef_pos`: a grasp
succeeds within a few millimetres, and a learner would have to find the kinematics of the arm in
the joint angles before it knew how far the hand is from the thing.
"""

from collections.abc import Sequence

import mujoco
import numpy as np

from teasim.constants import ARMS

_POSE = ("x", "y", "z", "qw", "qx", "qy", "qz")


def hand_view_names(things: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the numbers of `HandView.read` for T `things`, (14 + 14 T,)."""
    views = (f"{arm}_hand" for arm in ARMS)
    relative = (f"{thing}_in_{arm}_hand" for arm in ARMS for thing in things)
    return tuple(f"{view}_{part}" for view in (*views, *relative) for part in _POSE)


class HandView:
    """Reads the poses of the hands in the world, and of things in the frames of the hands.

    The frame of a hand is that of its tool centre point, midway between the finger tips: z points
    out of the hand, y from finger to finger. All poses are those of the same instant, the beginning
    of the last physics step.
    """

    def __init__(self, model: mujoco.MjModel, bodies: Sequence[str]) -> None:
        """Find the hands and the bodies of the things in `model`."""
        self._hands = np.array([model.site(f"{arm}_tcp").id for arm in ARMS])
        self._bodies = np.array([model.body(name).id for name in bodies])

    def read(self, data: mujoco.MjData) -> np.ndarray:
        """Return position [m] and quaternion (wxyz, w >= 0) of all views, (14 + 14 T,).

        The order is both hands in the world, then every thing in the right hand's frame, then
        every thing in the left hand's frame.
        """
        places, turns = data.site_xpos[self._hands], _matrices(data.site_xmat[self._hands])
        things, leans = data.xpos[self._bodies], _matrices(data.xmat[self._bodies])
        away = np.einsum("hji,htj->hti", turns, things[None] - places[:, None])
        turned = np.einsum("hji,tjk->htik", turns, leans)
        positions = np.concatenate([places, away.reshape(-1, 3)])
        rotations = np.concatenate([turns, turned.reshape(-1, 3, 3)])
        return np.hstack([positions, _quaternions(rotations)]).ravel()


def _matrices(flat: np.ndarray) -> np.ndarray:
    return flat.reshape(-1, 3, 3)


def _quaternions(rotations: np.ndarray) -> np.ndarray:
    """Return the quaternions (n, 4), wxyz with w >= 0, of rotation matrices (n, 3, 3)."""
    found = np.empty((len(rotations), 4))
    for quaternion, rotation in zip(found, rotations, strict=True):
        mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    return found * np.where(found[:, :1] < 0, -1.0, 1.0)
