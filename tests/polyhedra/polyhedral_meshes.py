"""Polyhedra and meshes of them that the tests share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshgauge.cells import cell_type
from meshgauge.mesh import Mesh
from meshgauge.polyhedra import Polyhedra
from meshgauge.polyhedral_quality import PolyhedralQuality, measure_polyhedra

Face = Sequence[int]

CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
CUBE_FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]


def polyhedra(cells: Iterable[Iterable[Face]]) -> Polyhedra:
    """Cells given as lists of faces, each face with points of its own."""
    lists = [[list(face) for face in cell] for cell in cells]
    faces = [face for cell in lists for face in cell]
    return Polyhedra(
        cell_offsets=np.cumsum([0] + [len(cell) for cell in lists]),
        cell_faces=np.arange(len(faces)),
        face_offsets=np.cumsum([0] + [len(face) for face in faces]),
        face_points=np.array([point for face in faces for point in face], np.int64),
    )


def measured(points: ArrayLike, *cells: Iterable[Face]) -> PolyhedralQuality:
    """What is measured on cells given as lists of faces."""
    return measure_polyhedra(np.array(points, float), polyhedra(cells), slice(0, len(cells)))


def converted(mesh: Mesh) -> Polyhedra:
    """The solid cells of a mesh as polyhedra, cell by cell; others have no faces."""
    cells: list[list[list[int]]] = []
    for cell, vtk_id in enumerate(mesh.types):
        row = cell_type(int(vtk_id))
        ids = mesh.nodes(cell)[list(row.corners)] if row.shape is not None else []
        cells.append([[int(ids[i]) for i in face] for face in row.shape.faces] if row.shape is not None else [])
    return polyhedra(cells)


def octree(refined: set[tuple[int, int, int]], n: int) -> tuple[NDArray[np.float64], list[list[list[int]]]]:
    """n³ cubes, some split in eight, as polyhedra that fit: a face beside smaller cubes is split in four, and an edge
    beside smaller ones has a node in its middle. Lengths are in halves of a cube."""
    leaves = []
    for cube in product(range(n), repeat=3):
        low = 2 * np.array(cube)
        if cube in refined:
            leaves += [(tuple(low + part), 1) for part in product(range(2), repeat=3)]
        else:
            leaves.append((tuple(low), 2))
    corners = {tuple(np.array(low) + size * np.array(c)) for low, size in leaves for c in product(range(2), repeat=3)}
    ids = {corner: i for i, corner in enumerate(sorted(corners))}
    cells = [[[ids[p] for p in face] for face in _octree_faces(np.array(low), size, corners)] for low, size in leaves]
    return np.array(sorted(corners), float), cells


def _octree_faces(low: NDArray[np.int64], size: int, corners: set[tuple[int, ...]]) -> list[list[tuple[int, ...]]]:
    faces = []
    for face in CUBE_FACES:
        ring = [tuple(int(v) for v in low + size * np.array(CUBE[i])) for i in face]
        middle = tuple(sum(axis) // 4 for axis in zip(*ring, strict=True))
        if size == 2 and middle in corners:
            mids = [_between(ring[i], ring[(i + 1) % 4]) for i in range(4)]
            faces += [[ring[i], mids[i], middle, mids[i - 1]] for i in range(4)]
        else:
            full = []
            for i in range(4):
                full.append(ring[i])
                mid = _between(ring[i], ring[(i + 1) % 4])
                if size == 2 and mid in corners:
                    full.append(mid)
            faces.append(full)
    return faces


def _between(a: tuple[int, ...], b: tuple[int, ...]) -> tuple[int, ...]:
    return tuple((x + y) // 2 for x, y in zip(a, b, strict=True))
