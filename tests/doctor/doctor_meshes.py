"""Grids of every type of cell, and ways to spoil them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from meshgauge import Mesh
from meshgauge.cells import BY_NAME, SHAPES, cell_type
from meshgauge.doctor import reversal

CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
TETRA = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))
WEDGE = ((0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7))
PYRAMID = ((0, 1, 2, 3, 8), (4, 7, 6, 5, 8), (0, 4, 5, 1, 8), (1, 5, 6, 2, 8), (2, 6, 7, 3, 8), (3, 7, 4, 0, 8))
SPLITS = {
    "tetra": TETRA,
    "wedge": WEDGE,
    "pyramid": PYRAMID,
    "hexahedron": (tuple(range(8)),),
    "voxel": ((0, 1, 3, 2, 4, 5, 7, 6),),
}
"""Cells of each type that fill a cube, whose node 8 is its middle. Neighbouring cubes fit."""

N_FACES = {"tetra": 12, "wedge": 8, "pyramid": 6, "hexahedron": 6, "voxel": 6}
"""Faces of the cells of one cube on its boundary."""


def grid(name: str, n: int = 3) -> Mesh:
    """The unit cube as ``n³`` cubes, each filled with cells of one type."""
    points, cubes = _cubes(n)
    if name == "pyramid":
        cubes = np.concatenate([cubes, len(points) + np.arange(len(cubes))[:, None]], axis=1)
        points = np.concatenate([points, points[cubes[:, :8]].mean(axis=1)])
    cells = cubes[:, np.array(SPLITS[name])].reshape(-1, len(SPLITS[name][0]))
    return Mesh.from_arrays(points, [(name, cells)])


def mixed() -> Mesh:
    """Four hexahedra and beside them eight wedges, in that order."""
    points, cubes = _cubes(2)
    wedges = cubes[1::2][:, np.array(WEDGE)].reshape(-1, 6)
    return Mesh.from_arrays(points, [("hexahedron", cubes[::2]), ("wedge", wedges)])


def _cubes(n: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points of a grid, and the corners of its cubes: layer by layer upwards."""
    axis = np.linspace(0.0, 1.0, n + 1)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    ids = np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    corners = [ids[c : n + c, b : n + b, a : n + a].ravel() for a, b, c in CORNERS]
    return np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), np.stack(corners, axis=1)


def reverse(mesh: Mesh, cells: Iterable[int]) -> Mesh:
    """The mesh with some cells numbered in reverse."""
    connectivity = mesh.connectivity.copy()
    for cell in cells:
        at = slice(int(mesh.offsets[cell]), int(mesh.offsets[cell + 1]))
        nodes = mesh.nodes(int(cell))
        order = reversal(int(mesh.types[cell]), len(nodes))
        assert order is not None
        connectivity[at] = nodes[list(order)]
    return mesh.replace(connectivity=connectivity)


def single(name: str) -> Mesh:
    """The ideal cell of a linear type, bent a little so that no two corners are alike."""
    row = cell_type(name)
    assert row.shape is not None
    points = np.array(SHAPES[row.shape.name].points)
    points = points + 0.1 * np.sin(np.arange(points.size)).reshape(points.shape)
    nodes = np.empty(len(points), np.int64)
    nodes[list(row.corners)] = np.arange(len(points))
    return Mesh.from_arrays(points, [(row.name, nodes[None])])


LINEAR = [row.name for row in BY_NAME.values() if row.shape is not None and row.n_nodes == row.shape.n_nodes]
