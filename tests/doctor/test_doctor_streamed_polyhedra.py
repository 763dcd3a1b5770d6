"""The diagnosis of polyhedra that pass by is that of the whole mesh."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from streamed_meshes import CELLS, MESHES, POINTS, SOME, WAYS, assert_same, hexahedra, size_of, streamed

import meshgauge
from meshgauge import Mesh
from meshgauge.cells import CELL_TYPES, POLYHEDRON
from meshgauge.doctor import Diagnosis, diagnosis
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.measure import Quality


def as_polyhedra(mesh: Mesh, every: int = 1, turned: float = 0.0) -> Mesh:
    """The mesh with every so-manieth solid cell as a polyhedron of the same faces, of which a share points inward."""
    types, random = mesh.types.copy(), np.random.default_rng(1)
    counts, rings = np.zeros(mesh.n_cells, np.int64), []
    for cell in range(0, mesh.n_cells, every):
        row = CELL_TYPES[int(types[cell])]
        if row.shape is None or row.dimension != 3:
            continue
        nodes = mesh.nodes(cell)
        types[cell], counts[cell] = POLYHEDRON.vtk_id, len(row.shape.faces)
        own = [[int(nodes[row.corners[m]]) for m in face] for face in row.shape.faces]
        rings += [ring[::-1] if random.random() < turned else ring for ring in own]
    poly = Polyhedra(
        np.concatenate([[0], np.cumsum(counts)]),
        np.arange(len(rings)),
        np.concatenate([[0], np.cumsum([len(ring) for ring in rings])]),
        np.array([point for ring in rings for point in ring]),
    )
    return mesh.replace(types=types, polyhedra=poly)


def columns(n: int) -> Mesh:
    """Prisms over a honeycomb, of six-cornered faces that only they have; their sides are quadrilaterals."""
    points: dict[tuple[float, float, float], int] = {}
    rings, cells = [], []
    for i in range(n):
        for j in range(n):
            x, y = 1.5 * i, np.sqrt(3.0) * (j + i % 2 / 2)
            corners = [(x + np.cos(a), y + np.sin(a)) for a in np.arange(6) * np.pi / 3]
            for k in range(n):
                low, high = (
                    [points.setdefault((round(a, 6), round(b, 6), z), len(points)) for a, b in corners]
                    for z in (float(k), float(k + 1))
                )
                sides = [[low[m], low[m - 5], high[m - 5], high[m]] for m in range(6)]
                rings += [low[::-1], high, *sides]
                cells.append(low + high)
    m = len(cells)
    return Mesh(
        points=np.array(list(points)),
        types=np.full(m, 42, np.uint8),
        offsets=np.arange(m + 1) * 12,
        connectivity=np.concatenate(cells),
        polyhedra=Polyhedra(
            np.arange(m + 1) * 8,
            np.arange(8 * m),
            np.concatenate([[0], np.cumsum([len(ring) for ring in rings])]),
            np.concatenate(rings),
        ),
    )


def with_crossed_faces() -> Mesh:
    """Faces that join their points in another order for one of two cells, and that name a point twice."""
    mesh = columns(4)
    poly = mesh.polyhedra
    assert poly is not None
    points = poly.face_points.copy()
    for face in (1, 9, 33, 130):
        at = int(poly.face_offsets[face])
        points[[at + 1, at + 3]] = points[[at + 3, at + 1]]
    for face in (2, 3, 65, 200):
        at = int(poly.face_offsets[face])
        points[at + 2] = points[at]
    broken = Polyhedra(poly.cell_offsets, poly.cell_faces, poly.face_offsets, points)
    return mesh.replace(polyhedra=broken)


def named_by_faces() -> Mesh:
    """Polyhedra with points that their faces name alone."""
    mesh = columns(4)
    return mesh.replace(connectivity=mesh.connectivity.reshape(-1, 12)[:, :3].reshape(-1), offsets=mesh.offsets // 4)


def without_faces() -> Mesh:
    """Polyhedra some of which have no face, or lack one."""
    mesh = columns(4)
    poly = mesh.polyhedra
    assert poly is not None
    counts = np.diff(poly.cell_offsets)
    kept = np.ones(len(poly.cell_faces), np.bool_)
    for cell, first in ((5, 0), (20, 3), (40, 7)):
        kept[8 * cell + first : 8 * cell + 8] = False
        counts[cell] = first
    faces = poly.cell_faces[kept]
    broken = Polyhedra(np.concatenate([[0], np.cumsum(counts)]), faces, poly.face_offsets, poly.face_points)
    return mesh.replace(polyhedra=broken)


def shared_faces() -> Mesh:
    """Each face once, inward for the second of its cells as far as it is told; and a few wrong."""
    n = len(CELLS)
    known: dict[tuple[int, ...], int] = {}
    rings: list[list[int]] = []
    entries, flipped = [], []
    for cell in CELLS.tolist():
        for face in CELL_TYPES[12].shape.faces:  # type: ignore[union-attr]
            ring = [cell[m] for m in face]
            key = tuple(sorted(ring))
            flipped.append(key in known)
            if key not in known:
                known[key] = len(rings)
                rings.append(ring)
            entries.append(known[key])
    wrong = np.random.default_rng(3).random(len(entries)) < 0.01
    return Mesh(
        points=POINTS,
        types=np.full(n, 42, np.uint8),
        offsets=np.arange(n + 1) * 8,
        connectivity=CELLS.reshape(-1),
        polyhedra=Polyhedra(
            np.arange(n + 1) * 6,
            np.array(entries),
            np.arange(len(rings) + 1) * 4,
            np.array(rings).reshape(-1),
            np.array(flipped) ^ wrong,
        ),
    )


AS_POLYHEDRA = (
    "a grid",
    "in any order",
    "shaken",
    "some reversed",
    "some twice",
    "all three times",
    "some twice, reversed",
    "four at a face",
    "four at one face",
    "two touch",
    "some cover",
    "hinges",
    "hanging",
    "surfaces",
    "collapsed",
    "flat",
    "not finite",
    "ghosts",
)
SPOILED: dict[str, Callable[[], Mesh]] = {
    **{f"{name}, all": lambda name=name: as_polyhedra(MESHES[name]()) for name in AS_POLYHEDRA},  # type: ignore[misc]
    **{f"{name}, a third": lambda name=name: as_polyhedra(MESHES[name](), 3) for name in AS_POLYHEDRA},  # type: ignore[misc]
    "columns": lambda: columns(5),
    "some inward": lambda: as_polyhedra(hexahedra(POINTS, CELLS), turned=0.02),
    "some inward, mixed": lambda: as_polyhedra(hexahedra(POINTS, CELLS), 2, turned=0.1),
    "shared faces": shared_faces,
    "half and half": lambda: as_polyhedra(hexahedra(POINTS, CELLS[np.argsort(SOME, kind="stable")]), 5),
    "crossed": with_crossed_faces,
    "named by faces": named_by_faces,
    "without faces": without_faces,
}


@cache
def whole(name: str) -> tuple[Quality, Diagnosis]:
    quality = meshgauge.measure(SPOILED[name]())
    return quality, diagnosis(quality.mesh, quality)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", SPOILED)
def test_it_is_that_of_the_whole(name: str, way: str, monkeypatch: pytest.MonkeyPatch) -> None:
    quality, expected = whole(name)
    assert_same(streamed(quality, size_of(way, monkeypatch)), expected)


def test_the_meshes_have_all_that_is_looked_for() -> None:
    names = {finding.name for name in SPOILED for finding in whole(name)[1].findings}
    assert names >= {
        "orientation",
        "misoriented_faces",
        "duplicate_cells",
        "covering_cells",
        "multiple_faces",
        "hanging_points",
        "hinges",
        "parts",
        "duplicate_points",
        "unused_points",
        "surface_cells",
        "points_of_no_solid",
    }
