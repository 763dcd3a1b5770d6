"""Meshes and comparisons that the tests of reading and writing share."""

from __future__ import annotations

import numpy as np

from meshgauge.cells import SHAPES
from meshgauge.mesh import Mesh

LINEAR = ("tetra", "wedge", "hexahedron", "pyramid")


def mesh_of(*names: str, n: int = 2) -> Mesh:
    """``n`` ideal cells of each shape, apart from one another, types alternating."""
    points, cells = [], []
    for number, name in enumerate(names * n):
        own = np.array(SHAPES[name].points) + np.array([3.0 * number, 0, 0])
        start = sum(len(p) for p in points)
        cells.append((name, [np.arange(start, start + len(own))]))
        points.append(own)
    return Mesh.from_arrays(np.concatenate(points), cells)


def assert_same_cells(a: Mesh, b: Mesh) -> None:
    """Points, types, offsets, connectivity and faces are equal."""
    for name in ("points", "types", "offsets", "connectivity"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    assert (a.polyhedra is None) == (b.polyhedra is None)
    if a.polyhedra is not None and b.polyhedra is not None:
        for name in ("cell_offsets", "cell_faces", "face_offsets", "face_points"):
            np.testing.assert_array_equal(getattr(a.polyhedra, name), getattr(b.polyhedra, name), err_msg=name)


def assert_same_data(a: Mesh, b: Mesh) -> None:
    """Point, cell and field data have the same names and values."""
    for kind in ("point_data", "cell_data", "field_data"):
        assert set(getattr(a, kind)) == set(getattr(b, kind))
        for name, values in getattr(a, kind).items():
            other = getattr(b, kind)[name]
            np.testing.assert_array_equal(values, other, err_msg=f"{kind} {name}")
            assert values.dtype.kind == other.dtype.kind
