"""Polyhedra as cells of a mesh: measured, written, and their faces matched, however the faces are shared."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.mesh.topology import topology

# Two cubes beside each other along x, as OpenFOAM has them: 11 faces, the one between them first.
pytestmark = pytest.mark.usefixtures("readers_here")

POINTS = np.array([(x, y, z) for x in range(3) for y in range(2) for z in range(2)], float)


def at(x: int, y: int, z: int) -> int:
    return 4 * x + 2 * y + z


def quad(axis: int, level: int, first: tuple[int, int]) -> list[int]:
    """A unit square at a level of an axis, seen counter-clockwise from the side of larger coordinates."""
    u, v = first
    corners = [(u, v), (u + 1, v), (u + 1, v + 1), (u, v + 1)]
    place = {
        0: lambda a, b: (level, a, b),
        1: lambda a, b: (b, level, a),
        2: lambda a, b: (a, b, level),
    }[axis]
    return [at(*place(a, b)) for a, b in corners]


def two_cubes() -> meshgauge.Mesh:
    between = quad(0, 1, (0, 0))
    left = [quad(0, 0, (0, 0))[::-1], *(quad(1, 0, (0, 0))[::-1], quad(1, 1, (0, 0)))]
    left += [quad(2, 0, (0, 0))[::-1], quad(2, 1, (0, 0))]
    right = [
        quad(0, 2, (0, 0)),
        quad(1, 0, (0, 1))[::-1],
        quad(1, 1, (0, 1)),
        quad(2, 0, (1, 0))[::-1],
        quad(2, 1, (1, 0)),
    ]
    faces = [between, *left, *right]
    polyhedra = Polyhedra(
        cell_offsets=np.array([0, 6, 12]),
        cell_faces=np.array([0, 1, 2, 3, 4, 5, 0, 6, 7, 8, 9, 10]),
        face_offsets=np.arange(0, 45, 4),
        face_points=np.concatenate(faces),
        flipped=np.array([False] * 6 + [True] + [False] * 5),
    )
    nodes = [np.unique(np.concatenate(part)) for part in ([between, *left], [between, *right])]
    return meshgauge.Mesh(
        points=POINTS,
        types=np.array([42, 42], np.uint8),
        offsets=np.array([0, 8, 16]),
        connectivity=np.concatenate(nodes),
        polyhedra=polyhedra,
    )


def test_a_face_between_two_cells_may_be_one() -> None:
    mesh = two_cubes()
    quality = meshgauge.measure(mesh)
    np.testing.assert_allclose(quality.values, 1.0)
    np.testing.assert_allclose(quality.node_jens, 1.0)
    np.testing.assert_allclose(quality.point_values, 1.0)
    faces = topology(mesh)
    assert (faces.n_interior, faces.n_boundary) == (1, 10)


@pytest.mark.parametrize("suffix", [".vtu", ".vtkhdf", ".vtk"])
def test_what_is_written_is_read_back(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"two{suffix}"
    meshgauge.write(path, two_cubes())
    quality = meshgauge.measure(meshgauge.read(path))
    np.testing.assert_allclose(quality.values, 1.0)


def test_the_worst_polyhedron_names_its_worst_node() -> None:
    mesh = two_cubes()
    points = np.array(mesh.points)
    points[at(2, 1, 1)] = (1.3, 0.4, 0.4)
    quality = meshgauge.measure(mesh.replace(points=points))
    worst = quality.worst(1)[0]
    assert (worst.cell, worst.point, worst.type) == (1, at(2, 1, 1), "polyhedron")
    assert worst.quality < 0
    assert mesh.nodes(1)[worst.node] == worst.point
    assert quality.point_node_values[worst.point] == worst.node_quality
    assert worst.status in ("concave", "inverted")


def test_flips_must_be_as_many_as_faces_of_cells() -> None:
    mesh = two_cubes()
    assert mesh.polyhedra is not None
    short = Polyhedra(
        mesh.polyhedra.cell_offsets,
        mesh.polyhedra.cell_faces,
        mesh.polyhedra.face_offsets,
        mesh.polyhedra.face_points,
        flipped=np.zeros(3, bool),
    )
    with pytest.raises(meshgauge.MeshError, match="flipped has length 3, expected 12"):
        mesh.replace(polyhedra=short)
