"""Surface cells beside solid ones, and points that no solid cell has."""

from __future__ import annotations

import numpy as np
import pytest
from doctor_meshes import SPLITS, grid

from meshgauge import Mesh
from meshgauge.cells import BY_NAME
from meshgauge.doctor import diagnosis
from meshgauge.doctor.surfaces import of_no_solid, points_of_no_solid
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.mesh.topology import topology

pytestmark = pytest.mark.usefixtures("path")


def with_boundary(name: str, n: int = 2) -> tuple[Mesh, list[tuple[str, list[int]]]]:
    """A grid, and its boundary as surface cells, each begun at another of its points and wound either way."""
    mesh = grid(name, n)
    faces = topology(mesh)
    surface = []
    for k, half_face in enumerate(np.flatnonzero(faces.mates < 0).tolist()):
        ring = list(faces.face(half_face))
        ring = ring[k % len(ring) :] + ring[: k % len(ring)]
        surface.append(("triangle" if len(ring) == 3 else "quad", ring[:: 1 if k % 2 else -1]))
    return mesh, surface


@pytest.mark.parametrize("name", SPLITS)
def test_the_boundary_of_a_mesh_is_faces_of_solids(name: str) -> None:
    mesh, surface = with_boundary(name)
    nodes = mesh.connectivity.reshape(mesh.n_cells, -1)
    whole = Mesh.from_arrays(mesh.points, [(name, nodes), *((kind, [ring]) for kind, ring in surface)])
    alone, n = of_no_solid(whole)
    assert (alone.tolist(), n) == ([], len(surface))
    assert diagnosis(whole).findings == ()


def test_three_of_four_surface_cells_are_no_face() -> None:
    cube = grid("hexahedron", 1)
    points = np.concatenate([cube.points, cube.points[:4] + np.array([0.0, 0.0, 3.0])])
    bottom = cube.nodes(0)[:4].tolist()
    mesh = Mesh.from_arrays(
        points,
        [
            ("hexahedron", [cube.nodes(0)]),
            ("quad", [bottom, (8, 9, 11, 10), (0, 1, 7, 6)]),  # one of points of its own, one through the inside
            ("triangle", [bottom[:3]]),  # half a face is no face
            ("line", [(0, 1)]),
            ("vertex", [(3,)]),
        ],
    )
    found = diagnosis(mesh)
    finding, points_finding = found.finding("surface_cells"), found.finding("points_of_no_solid")
    assert finding is not None
    assert points_finding is not None
    assert (finding.level, finding.count, finding.examples) == ("notice", 3, (2, 3, 4))
    assert finding.text == "3 of 4 surface cells are no face of a solid cell (cells 2, 3, 4)."
    assert (points_finding.count, points_finding.examples) == (4, (8, 9, 10, 11))
    assert found.finding("unused_points") is None


@pytest.mark.parametrize("name", ["triangle6", "quad8", "quad9", "pixel"])
def test_curved_surface_cells_are_matched_by_their_corners(name: str) -> None:
    row = BY_NAME[name]
    assert row.n_nodes is not None
    solid = "tetra" if row.n_corners == 3 else "hexahedron"
    cube = grid(solid, 1)
    face = list(topology(cube).face(0))
    corners = [face[0], face[1], face[3], face[2]] if name == "pixel" else face
    extra = np.full((row.n_nodes - row.n_corners, 3), 0.5)
    ids = [*corners, *range(cube.n_points, cube.n_points + len(extra))]
    nodes = cube.connectivity.reshape(cube.n_cells, -1)
    mesh = Mesh.from_arrays(np.concatenate([cube.points, extra]), [(solid, nodes), (name, [ids])])
    assert of_no_solid(mesh)[0].tolist() == []
    assert points_of_no_solid(mesh).tolist() == list(range(cube.n_points, mesh.n_points))


def test_faces_of_polyhedra_count() -> None:
    cube = grid("hexahedron", 1)
    faces = topology(cube)
    rings = [list(faces.face(f)) for f in range(6)]
    mesh = Mesh(
        points=cube.points,
        types=np.array([42, 9, 9], np.uint8),
        offsets=np.array([0, 8, 12, 16]),
        connectivity=np.array([*range(8), *rings[2], 0, 1, 7, 6]),
        polyhedra=Polyhedra(
            np.array([0, 6, 6, 6]), np.arange(6), np.arange(0, 25, 4), np.array([p for ring in rings for p in ring])
        ),
    )
    assert of_no_solid(mesh) == ([2], 2)
