"""The committed shapes are those that the program draws, and they are fit to be rendered."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
ASSETS = ROOT / "assets"
MESHES = sorted(path.relative_to(ASSETS) for path in ASSETS.glob("*/meshes/*.obj"))


def read(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n, 3) [m] and triangles (m, 3), indexes from 0, of an OBJ file."""
    rows = [line.split() for line in path.read_text().splitlines()]
    vertices = np.array([row[1:] for row in rows if row[0] == "v"], dtype=float)
    return vertices, np.array([row[1:] for row in rows if row[0] == "f"], dtype=int) - 1


def corners(path: Path) -> np.ndarray:
    """Corners of all triangles (m, 9) [m], each from its smallest one on, in order."""
    vertices, triangles = read(path)
    points = np.round(vertices, 4)[triangles]
    turned = []
    for triangle in points:
        first = min(range(3), key=lambda k: tuple(triangle[k]))
        turned.append(np.roll(triangle, -first, axis=0).ravel())
    return np.array(sorted(turned, key=tuple))


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("assets")
    command = [sys.executable, str(ROOT / "scripts/make_meshes.py"), "--assets", str(folder)]
    subprocess.run(command, check=True)
    return folder


def test_every_shape_is_drawn_and_every_drawn_shape_is_there(drawn):
    assert sorted(path.relative_to(drawn) for path in drawn.rglob("*.obj")) == MESHES
    used = "".join(path.read_text() for path in ASSETS.glob("*/*.xml"))
    assert [path.name for path in MESHES if f'file="{path.name}"' not in used] == []


@pytest.mark.parametrize("mesh", MESHES, ids=lambda path: path.stem)
def test_the_committed_shapes_are_the_drawn_ones(drawn, mesh):
    # Triangles may come in another order, and the last digit may fall otherwise, elsewhere.
    ours, theirs = (read(folder / mesh) for folder in (ASSETS, drawn))
    assert ours[0].shape == theirs[0].shape
    assert ours[1].shape == theirs[1].shape
    assert np.sort(ours[0], axis=0) == pytest.approx(np.sort(theirs[0], axis=0), abs=1.5e-5)
    assert corners(ASSETS / mesh) == pytest.approx(corners(drawn / mesh), abs=1.5e-4)


@pytest.mark.parametrize("mesh", MESHES, ids=lambda path: path.stem)
def test_shapes_point_outwards(mesh):
    vertices, triangles = read(ASSETS / mesh)
    assert triangles.min() >= 0
    assert triangles.max() < len(vertices)
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 > 0  # enclosed volume
