"""Polyhedra and meshes of them that the tests share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshgauge.cells import cell_type
from meshgauge.mesh import Mesh
from meshgauge.polyhedra import Polyhedra
from meshgauge.polyhedral_quality import PolyhedralQuality, measure_polyhedra

Face = Sequence[int]
Point = tuple[int, ...]

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


def octree(
    depths: Mapping[Point, int], n: int, *, halves: frozenset[Point] = frozenset()
) -> tuple[NDArray[np.float64], list[list[list[int]]]]:
    """n³ cubes, some split in eight once or more, as polyhedra that fit: a face beside smaller cubes is split as they
    are, and an edge beside smaller ones has their nodes on it. Lengths are in quarters of a cube; ``halves``
    are the low corners of half cubes that are split once more."""
    leaves: list[tuple[Point, int]] = []
    todo = [((4 * x, 4 * y, 4 * z), 4, depths.get((x, y, z), 0)) for x, y, z in product(range(n), repeat=3)]
    for low, size, depth in todo:
        if depth == 0:
            leaves.append((low, size))
        else:
            half = size // 2
            parts = product(*((a, a + half) for a in low))
            todo += [(part, half, max(depth - 1, int(half == 2 and part in halves))) for part in parts]
    corners = {tuple(a + size * b for a, b in zip(low, c, strict=True)) for low, size in leaves for c in CUBE}
    ids = {corner: i for i, corner in enumerate(sorted(corners))}
    cells = []
    for low, size in leaves:
        at = [tuple(a + size * b for a, b in zip(low, c, strict=True)) for c in CUBE]
        faces = [part for face in CUBE_FACES for part in _parts([at[i] for i in face], corners)]
        cells.append([[ids[p] for p in face] for face in faces])
    return np.array(sorted(corners), float), cells


def _parts(ring: list[Point], corners: set[Point]) -> list[list[Point]]:
    """A square, or its quarters if its middle is a corner of some cube; with the corners that lie on its sides."""
    middle = _between(ring[0], ring[2])
    mids = [_between(ring[i], ring[(i + 1) % 4]) for i in range(4)]
    if max(abs(a - b) for a, b in zip(ring[0], ring[2], strict=True)) > 1 and middle in corners:
        quarters = [[ring[i], mids[i], middle, mids[i - 1]] for i in range(4)]
        return [part for quarter in quarters for part in _parts(quarter, corners)]
    return [[p for i in range(4) for p in _side(ring[i], ring[(i + 1) % 4], corners)]]


def _side(a: Point, b: Point, corners: set[Point]) -> list[Point]:
    """From a to b, without b."""
    mid = _between(a, b)
    if max(abs(x - y) for x, y in zip(a, b, strict=True)) == 1 or mid not in corners:
        return [a]
    return [*_side(a, mid, corners), *_side(mid, b, corners)]


def _between(a: Point, b: Point) -> Point:
    x, y, z = ((p + q) // 2 for p, q in zip(a, b, strict=True))
    return x, y, z
