"""Small pieces of rigid-body geometry the skills share. Poses are `mink.SE3`."""

import numpy as np
from mink import SE3, SO3

DOWN = np.array([0.0, 0.0, -1.0])
UP = np.array([0.0, 0.0, 1.0])


def pose(position: np.ndarray, rotation: np.ndarray) -> SE3:
    """Pose from a position (3,) [m] and a rotation matrix (3, 3)."""
    return SE3.from_rotation_and_translation(SO3.from_matrix(rotation), np.asarray(position))


def position(of: SE3) -> np.ndarray:
    """Position (3,) [m]."""
    return np.asarray(of.translation())


def rotation(of: SE3) -> np.ndarray:
    """Rotation matrix (3, 3)."""
    return np.asarray(of.rotation().as_matrix())


def shifted(start: SE3, offset: np.ndarray) -> SE3:
    """The pose moved by `offset` (3,) [m] in world axes."""
    return pose(position(start) + offset, rotation(start))


def about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix (3, 3) about a unit `axis` (3,) by `angle` [rad]."""
    return np.asarray(SO3.exp(np.asarray(axis) * angle).as_matrix())


def tool(forward: np.ndarray, closing: np.ndarray) -> np.ndarray:
    """Rotation matrix of a gripper that points along `forward` and closes along `closing`."""
    z = forward / np.linalg.norm(forward)
    x = closing - z * (closing @ z)
    x = x / np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def flipped(grasp: SE3) -> SE3:
    """The same grasp with the two fingers exchanged."""
    return pose(position(grasp), rotation(grasp) @ np.diag([-1.0, -1.0, 1.0]))


def between(start: SE3, end: SE3, share: float) -> SE3:
    """Straight line in position, shortest turn in orientation; `share` in [0, 1]."""
    turn = start.rotation().inverse() @ end.rotation()
    orientation = start.rotation() @ SO3.exp(turn.log() * share)
    middle = position(start) + (position(end) - position(start)) * share
    return SE3.from_rotation_and_translation(orientation, middle)


def turn_angle(start: SE3, end: SE3) -> float:
    """Angle of the shortest turn from one orientation to the other [rad]."""
    return float(np.linalg.norm((start.rotation().inverse() @ end.rotation()).log()))


def ease(share: np.ndarray) -> np.ndarray:
    """Minimum-jerk timing: rest to rest, peak speed 1.875 times the mean."""
    return np.asarray(share**3 * (10 - 15 * share + 6 * share**2))


EASE_PEAK = 1.875
"""Peak of the derivative of `ease`."""
