"""Rigid-body geometry for the skills. Poses are `mink.SE3` in the world frame."""

import numpy as np
from mink import SE3, SO3

DOWN = np.array([0.0, 0.0, -1.0])
"""Unit vector (3,) towards the ground."""
UP = np.array([0.0, 0.0, 1.0])
"""Unit vector (3,) away from the ground."""


def pose(position: np.ndarray, rotation: np.ndarray) -> SE3:
    """Return the pose with a position (3,) [m] and a rotation matrix (3, 3)."""
    return SE3.from_rotation_and_translation(SO3.from_matrix(rotation), np.asarray(position))


def position(of: SE3) -> np.ndarray:
    """Return the position of a pose (3,) [m]."""
    return np.asarray(of.translation())


def rotation(of: SE3) -> np.ndarray:
    """Return the rotation matrix of a pose (3, 3)."""
    return np.asarray(of.rotation().as_matrix())


def shifted(start: SE3, offset: np.ndarray) -> SE3:
    """Return the pose moved by `offset` (3,) [m] in world axes."""
    return pose(position(start) + offset, rotation(start))


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Return the rotation matrix (3, 3) about a unit `axis` (3,) by `angle` [rad]."""
    return np.asarray(SO3.exp(np.asarray(axis) * angle).as_matrix())


def tool(forward: np.ndarray, closing: np.ndarray) -> np.ndarray:
    """Return the rotation matrix (3, 3) of a gripper.

    Args:
        forward: Direction in which it points (3,), of any length.
        closing: Direction in which it closes (3,); its part along `forward` is removed.
    """
    z = forward / np.linalg.norm(forward)
    x = closing - z * (closing @ z)
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def flipped(grasp: SE3) -> SE3:
    """Return the same grasp with the two fingers exchanged."""
    return pose(position(grasp), rotation(grasp) @ np.diag([-1.0, -1.0, 1.0]))


def between(start: SE3, end: SE3, share: float) -> SE3:
    """Interpolate along a straight line and the shortest rotation; `share` in [0, 1]."""
    turn = start.rotation().inverse() @ end.rotation()
    orientation = start.rotation() @ SO3.exp(turn.log() * share)
    middle = position(start) + (position(end) - position(start)) * share
    return SE3.from_rotation_and_translation(orientation, middle)


def turn_angle(start: SE3, end: SE3) -> float:
    """Return the angle of the shortest rotation between two orientations [rad]."""
    return float(np.linalg.norm((start.rotation().inverse() @ end.rotation()).log()))


def ease(share: np.ndarray) -> np.ndarray:
    """Return minimum-jerk progress (n,) for shares of time (n,), both 0 to 1."""
    return np.asarray(share**3 * (10 - 15 * share + 6 * share**2))


EASE_PEAK = 1.875
"""Peak of the derivative of `ease`, whose mean is 1."""
