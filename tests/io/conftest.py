"""Fixtures of the tests of reading and writing."""

from __future__ import annotations

import numpy as np
import pytest
from io_meshes import LINEAR, mesh_of

from meshgauge.cells import SHAPES
from meshgauge.mesh import Mesh
from meshgauge.mesh.polyhedra import Polyhedra


@pytest.fixture
def solid() -> Mesh:
    """Tetra, wedge, hexahedron and pyramid, twice."""
    return mesh_of(*LINEAR)


@pytest.fixture
def loaded() -> Mesh:
    """Many types, curved ones and surfaces among them, with data of many kinds."""
    rng = np.random.default_rng(3)
    points = rng.random((60, 3))

    def ids(n: int) -> list[np.ndarray]:
        return [rng.permutation(60)[:n]]

    mesh = Mesh.from_arrays(
        points,
        [
            ("tetra", ids(4)),
            ("triangle", ids(3)),
            ("tetra10", ids(10)),
            ("hexahedron", ids(8)),
            ("tetra", ids(4)),
            ("hexahedron20", ids(20)),
            ("hexahedron27", ids(27)),
            ("pyramid", ids(5)),
            ("pyramid13", ids(13)),
            ("voxel", ids(8)),
            ("line", ids(2)),
            ("penta_prism", ids(10)),
        ],
    )
    n, p = mesh.n_cells, mesh.n_points
    return mesh.replace(
        point_data={"u": rng.random((p, 3)), "t": rng.random(p).astype(np.float32), "id": np.arange(p)},
        cell_data={
            "material": np.arange(n, dtype=np.int32),
            "stress": rng.random((n, 6)),
            "flag": np.ones(n, np.uint8),
        },
        field_data={"time": np.array([0.25]), "title": np.array(["a title"])},
    )


@pytest.fixture
def polyhedral() -> Mesh:
    """A hexahedron and, on top of it, the same cube as a polyhedron."""
    cube = np.array(SHAPES["hexahedron"].points)
    faces = np.array(SHAPES["hexahedron"].faces) + 8
    return Mesh(
        points=np.concatenate([cube, cube + np.array([0, 0, 1])]),
        types=np.array([12, 42], np.uint8),
        offsets=np.array([0, 8, 16]),
        connectivity=np.arange(16),
        polyhedra=Polyhedra(
            cell_offsets=np.array([0, 0, 6]),
            cell_faces=np.arange(6),
            face_offsets=np.arange(0, 25, 4),
            face_points=faces.ravel(),
        ),
    )
