"""Polyhedra and meshes of them that the tests share."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meshgauge.cells import cell_type
from meshgauge.mesh import Mesh
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.polyhedra import PolyhedralQuality, measure_polyhedra

Face = Sequence[int]
Point = tuple[int, ...]

TETRA_FACES = [(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)]
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


def mesh_of(points: ArrayLike, cells: Sequence[Iterable[Face]]) -> Mesh:
    """A mesh of polyhedra given as lists of faces."""
    lists = [[list(face) for face in cell] for cell in cells]
    nodes = [sorted({point for face in cell for point in face}) for cell in lists]
    return Mesh(
        points=np.array(points, float),
        types=np.full(len(lists), 42, np.uint8),
        offsets=np.cumsum([0] + [len(ids) for ids in nodes]),
        connectivity=np.array([i for ids in nodes for i in ids]),
        polyhedra=polyhedra(lists),
    )


def boxes(leaves: Sequence[tuple[Point, Point]]) -> Mesh:
    """Boxes ``(low, high)`` that fill a space, as polyhedra that fit: each face is cut as the boxes beyond it are."""
    pieces: list[list[tuple[int, int, tuple[Point, ...]]]] = []
    for low, high in leaves:
        mine = []
        for axis, side in product(range(3), range(2)):
            level = (low, high)[side][axis]
            u, v = ((axis + 1) % 3, (axis + 2) % 3)
            beyond = [b for b in leaves if (b[1], b[0])[side][axis] == level]
            cuts = [_overlap((low, high), b, u, v) for b in beyond]
            for (u0, u1), (v0, v1) in [c for c in cuts if c] or [((low[u], high[u]), (low[v], high[v]))]:
                ring = []
                for a, b in ((u0, v0), (u1, v0), (u1, v1), (u0, v1)):
                    at = {axis: level, u: a, v: b}
                    ring.append((at[0], at[1], at[2]))
                mine.append((axis, side, tuple(ring)))
        pieces.append(mine)
    corners = sorted({point for mine in pieces for _, _, ring in mine for point in ring})
    ids = {point: i for i, point in enumerate(corners)}
    cells = []
    for mine in pieces:
        faces = []
        for _, side, ring in mine:
            whole = [
                point
                for i in range(4)
                for point in (
                    ring[i],
                    *sorted(
                        (c for c in corners if _inside(ring[i], c, ring[(i + 1) % 4])), key=lambda c: _far(ring[i], c)
                    ),
                )
            ]
            faces.append([ids[point] for point in (whole if side else whole[::-1])])
        cells.append(faces)
    return mesh_of(corners, cells)


def _overlap(a: tuple[Point, Point], b: tuple[Point, Point], u: int, v: int) -> list[tuple[int, int]]:
    """The ranges along two axes that boxes have in common; empty if none."""
    ranges = [(max(a[0][axis], b[0][axis]), min(a[1][axis], b[1][axis])) for axis in (u, v)]
    return ranges if all(low < high for low, high in ranges) else []


def _far(a: Point, b: Point) -> int:
    return sum(abs(x - y) for x, y in zip(a, b, strict=True))


def _inside(a: Point, c: Point, b: Point) -> bool:
    """True if a corner lies between two others."""
    return (
        c not in (a, b)
        and _far(a, c) + _far(c, b) == _far(a, b)
        and sum(x != y for x, y in zip(a, b, strict=True)) == 1
    )
