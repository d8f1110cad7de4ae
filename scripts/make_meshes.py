"""Compute the low-poly meshes of the robot and the props and write them as OBJ files.

All shapes are designed here: tubes swept between the joint origins of the arm, chamfered boxes for
the body, and lathe profiles for the vessels. Run it after a change of a shape; a test compares the
files in `assets/` with its output.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull

ASSETS = Path(__file__).resolve().parent.parent / "assets"
Mesh = tuple[np.ndarray, np.ndarray]  # vertices (n, 3) in m, triangles (m, 3)


def lathe(profile: Sequence[tuple[float, float]], sides: int = 24) -> Mesh:
    """Revolve a profile of (radius, height) [m] about z; faces point outward if it runs upward."""
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rings = [np.c_[r * np.cos(angles), r * np.sin(angles), np.full(sides, z)] for r, z in profile]
    return np.concatenate(rings), _quads(len(rings), sides)


def tube(points: Sequence[Sequence[float]], radii: Sequence[float], sides: int = 14) -> Mesh:
    """Sweep a circle along a polyline (n, 3) [m] with radii (n,) [m]; the ends are rounded."""
    path, radius = np.asarray(points, float), np.asarray(radii, float)
    first, last = _unit(path[0] - path[1]), _unit(path[-1] - path[-2])
    caps = [(0.97, 0.30), (0.75, 0.66), (0.38, 0.92), (0.02, 1.0)]  # a quarter circle (r, height)
    start = [(path[0] + first * radius[0] * h, radius[0] * r) for r, h in reversed(caps)]
    end = [(path[-1] + last * radius[-1] * h, radius[-1] * r) for r, h in caps]
    stations = [*start, *zip(path, radius, strict=True), *end]
    centres = np.array([centre for centre, _ in stations])
    directions = np.gradient(centres, axis=0)
    side = _any_normal(directions[0])
    rings = []
    angles = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    for (centre, r), direction in zip(stations, directions, strict=True):
        along = _unit(direction)
        side = _unit(side - along * (side @ along))  # parallel transport keeps the tube untwisted
        up = np.cross(along, side)
        rings.append(centre + r * (np.outer(np.cos(angles), side) + np.outer(np.sin(angles), up)))
    return np.concatenate(rings), _quads(len(rings), sides)


def chamfered_box(centre: Sequence[float], half: Sequence[float], chamfer: float) -> Mesh:
    """Return a box with centre and half sizes (3,) [m] and edges cut off by `chamfer` [m]."""
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners = []
    for axis in range(3):
        inset = np.asarray(half, float) - chamfer
        inset[axis] = half[axis]
        corners.append(signs * inset)
    return hull(np.concatenate(corners) + np.asarray(centre, float))


def hull(points: np.ndarray) -> Mesh:
    """Return the convex hull of points (n, 3) [m] with triangles that face outward."""
    result = ConvexHull(points)
    keep = np.unique(result.simplices)
    index = np.full(len(points), -1)
    index[keep] = np.arange(len(keep))
    vertices, triangles = points[keep], index[result.simplices]
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - vertices.mean(axis=0)) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return vertices, triangles


def join(*meshes: Mesh) -> Mesh:
    """Concatenate meshes."""
    offset, vertices, triangles = 0, [], []
    for v, t in meshes:
        vertices.append(v)
        triangles.append(t + offset)
        offset += len(v)
    return np.concatenate(vertices), np.concatenate(triangles)


def moved(mesh: Mesh, offset: Sequence[float]) -> Mesh:
    """Translate a mesh by `offset` (3,) [m]."""
    return mesh[0] + np.asarray(offset, float), mesh[1]


def axle(half_length: float, radius: float, sides: int = 16) -> Mesh:
    """Return a joint housing: a cylinder along z with rounded edges; lengths in m."""
    edge = 0.15 * radius
    profile = [
        (0.001, -half_length),
        (radius - edge, -half_length),
        (radius, -half_length + edge),
        (radius, half_length - edge),
        (radius - edge, half_length),
        (0.001, half_length),
    ]
    return lathe(profile, sides)


def _quads(rings: int, sides: int) -> np.ndarray:
    triangles = []
    for ring in range(rings - 1):
        for k in range(sides):
            a, b = ring * sides + k, ring * sides + (k + 1) % sides
            triangles += [(a, b, b + sides), (a, b + sides, a + sides)]
    return np.array(triangles)


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _any_normal(direction: np.ndarray) -> np.ndarray:
    helper = np.eye(3)[np.argmin(np.abs(direction))]
    return _unit(np.cross(direction, helper))


def vessel(outer: float, inner: float, height: float, base: float) -> Mesh:
    """Return an open vessel with outer and inner radius, height and thickness of the base [m]."""
    rim = outer - 0.0008
    return lathe(
        [
            (0.001, 0.0),
            (outer * 0.86, 0.0),
            (outer * 0.97, height * 0.12),
            (outer, height * 0.5),
            (rim, height),
            (inner, height),
            (inner, base + 0.004),
            (inner * 0.9, base),
            (0.001, base),
        ]
    )


def spout(start: Sequence[float], tip: Sequence[float], wide: float, narrow: float) -> Mesh:
    """Return a spout that tapers from radius `wide` at `start` to `narrow` at `tip` [m]."""
    return tube([start, tip], [wide, narrow], sides=8)


def handle(bar_x: float, body: float, low: float, high: float) -> Mesh:
    """Return a handle: a bar parallel to the vessel's axis and two cross-bars; lengths in m."""
    bar = chamfered_box((bar_x, 0, (low + high) / 2), (0.006, 0.008, (high - low) / 2), 0.002)
    reach = (body - abs(bar_x)) / 2
    centre = bar_x - reach
    across = abs(reach) + 0.004
    return join(
        bar,
        chamfered_box((centre, 0, high - 0.003), (across, 0.006, 0.003), 0.001),
        chamfered_box((centre, 0, low + 0.003), (across, 0.006, 0.003), 0.001),
    )


ROBOT = {
    "torso": join(
        chamfered_box((-0.2, 0, 0.05), (0.16, 0.2, 0.05), 0.03),
        chamfered_box((-0.235, 0, 0.25), (0.115, 0.13, 0.22), 0.045),
        chamfered_box((-0.09, 0, 0.40), (0.095, 0.12, 0.065), 0.035),
    ),
    "feet": join(
        chamfered_box((0, 0.145, 0.03), (0.135, 0.055, 0.03), 0.015),
        chamfered_box((0, -0.145, 0.03), (0.135, 0.055, 0.03), 0.015),
    ),
    "link_1": tube([(0, 0, 0.02), (0, 0, 0.06), (0.03, 0, 0.1)], [0.06, 0.058, 0.05]),
    "link_2": tube([(-0.01, 0.01, 0), (-0.03, 0.10, 0), (-0.03, 0.165, 0)], [0.05, 0.054, 0.046]),
    "link_3": tube([(0, 0, 0.015), (-0.015, 0, 0.05), (-0.042, 0, 0.079)], [0.048, 0.048, 0.042]),
    "link_4": tube([(0.005, 0.01, 0), (0.035, 0.09, 0), (0.0405, 0.155, 0)], [0.044, 0.048, 0.040]),
    "link_5": tube([(0, 0, 0.01), (-0.01, 0, 0.06), (-0.027, 0, 0.1)], [0.040, 0.041, 0.032]),
    "link_6": tube([(0, 0, 0), (0.027, 0.012, 0)], [0.031, 0.030]),
    "link_7": axle(0.012, 0.032),
    "housing_2": axle(0.056, 0.043),
    "housing_4": axle(0.052, 0.038),
    "housing_6": moved(axle(0.042, 0.030), (0, 0, -0.016)),
    "gripper": hull(
        np.concatenate(
            [
                chamfered_box((0, 0, 0.03), (0.034, 0.033, 0.03), 0.012)[0],
                chamfered_box((0, 0, 0.066), (0.042, 0.022, 0.016), 0.006)[0],
            ]
        )
    ),
    "finger": hull(
        np.array(
            [
                (x, y, z)
                for y in (-0.0105, 0.0105)
                for x, z in ((-0.011, 0), (0, 0), (0, 0.052), (-0.004, 0.052), (-0.011, 0.03))
            ]
        )
    ),
}

PROPS = {
    "kettle": vessel(0.042, 0.039, 0.075, 0.003),
    "kettle_trim": join(
        handle(-0.072, 0.042, 0.012, 0.075),
        spout((0.036, 0, 0.052), (0.060, 0, 0.070), 0.010, 0.004),
    ),
    "milk_jug": vessel(0.026, 0.023, 0.060, 0.003),
    "milk_jug_trim": join(
        handle(-0.053, 0.026, 0.008, 0.058),
        spout((0.022, 0, 0.052), (0.034, 0, 0.0605), 0.007, 0.003),
    ),
    "sugar_pot": vessel(0.026, 0.023, 0.052, 0.003),
    "sugar_pot_trim": join(
        handle(-0.053, 0.026, 0.006, 0.054),
        spout((0.022, 0, 0.044), (0.032, 0, 0.0505), 0.007, 0.003),
    ),
    "cup": vessel(0.040, 0.036, 0.072, 0.006),
    "cup_handle": tube(
        [
            (0.038, 0, 0.056),
            (0.056, 0, 0.054),
            (0.060, 0, 0.036),
            (0.054, 0, 0.020),
            (0.037, 0, 0.018),
        ],
        [0.0045] * 5,
        sides=8,
    ),
}


def write_obj(path: Path, mesh: Mesh) -> None:
    """Write a mesh with a resolution of 0.01 mm, which is the same on every machine."""
    vertices, triangles = mesh
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in vertices + 0.0]
    lines += [f"f {a} {b} {c}" for a, b, c in triangles + 1]
    path.write_text("\n".join(lines) + "\n")


def write_all(assets: Path) -> None:
    """Write every mesh below `assets`."""
    for folder, meshes in (("abb_yumi", ROBOT), ("tea_props", PROPS)):
        target = assets / folder / "meshes"
        target.mkdir(parents=True, exist_ok=True)
        for name, mesh in meshes.items():
            write_obj(target / f"{name}.obj", mesh)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--assets", type=Path, default=ASSETS, help="folder to write into")
    write_all(parser.parse_args().assets)
