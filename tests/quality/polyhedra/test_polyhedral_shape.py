"""`shape` of polyhedra: against the cell types, the regular-faced solids, and the corners of the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest
from polyhedral_meshes import converted, mesh_of, octree

import meshgauge
from meshgauge import Mesh
from meshgauge.cells import SHAPES
from meshgauge.quality import polyhedra
from meshgauge.quality.reference import Solid, antiprism, corner_cosines, corner_model, prism, solids

SOLIDS = (*solids(), *(antiprism(n) for n in (3, 4, 5, 30)), *(prism(n) for n in (3, 4, 7)))


def shapes(mesh: Mesh, threads: int | None = None) -> np.ndarray:
    return np.array(meshgauge.measure(mesh, metrics="shape", threads=threads).values_of("shape"))


def together(of: Callable[[Solid], tuple[np.ndarray, Sequence[tuple[int, ...]]]]) -> Mesh:
    """All solids, each with points and faces of its own, in one mesh."""
    points: list[np.ndarray] = []
    cells, start = [], 0
    for one in SOLIDS:
        x, faces = of(one)
        points.append(x)
        cells.append([tuple(point + start for point in face) for face in faces])
        start += len(x)
    return mesh_of(np.concatenate(points), cells)


def turned(points: np.ndarray) -> np.ndarray:
    q = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    return 3.7 * points @ (q * np.linalg.det(q)) + 5.0


@pytest.mark.parametrize("name", SHAPES)
def test_polyhedra_have_the_values_of_the_cells_that_they_are(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(polyhedra, "CHUNK", 16)
    ideal, rng = np.array(SHAPES[name].points), np.random.default_rng(0)
    x = np.concatenate([ideal + noise * rng.standard_normal((20, *ideal.shape)) for noise in (0.05, 0.3, 1.0)])
    x[3, 1] = x[3, 0]  # an edge of no length
    x[4] *= [1.0, 1.0, 1e-3]
    x[5, 0, 0] = np.nan
    x[6] = np.ldexp(x[6], -300)
    cells = np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])
    mesh = Mesh.from_arrays(x.reshape(-1, 3), {name: cells})
    as_polyhedra = mesh.replace(types=np.full(len(x), 42, np.uint8), polyhedra=converted(mesh))
    for threads in (1, 2):
        np.testing.assert_allclose(shapes(as_polyhedra, threads), shapes(mesh), rtol=1e-11, atol=1e-13)


def test_regular_faced_solids_are_ideal_turned_scaled_mirrored_and_none_stretched_is() -> None:
    np.testing.assert_allclose(shapes(together(lambda one: (turned(one.points), one.faces))), 1.0, atol=1e-10)
    np.testing.assert_allclose(shapes(together(lambda one: (-one.points, one.faces))), -1.0, atol=1e-10)
    mirrored = together(lambda one: (-one.points, tuple(face[::-1] for face in one.faces)))
    np.testing.assert_allclose(shapes(mirrored), 1.0, atol=1e-10)
    assert shapes(together(lambda one: (one.points * [4.0, 1.0, 1.0], one.faces))).max() < 0.8


def test_the_angles_of_the_corner_model_have_its_constant() -> None:
    rng = np.random.default_rng(0)
    for d in (3, 4, 5, 7):
        sizes, n_nodes = rng.integers(3, 9, (50, d)), rng.integers(8, 60, 50)
        sides, diagonals = corner_cosines(sizes, n_nodes)
        a, b, c = sides, diagonals, np.roll(sides, -1, axis=1)
        gram = 1.0 + 2.0 * a * b * c - a * a - b * b - c * c  # the square of the determinant of three unit edges
        np.testing.assert_allclose(np.sqrt(gram.min(axis=1)), corner_model(sizes, n_nodes), rtol=1e-9)


def cells_without_a_solid() -> Mesh:
    """A hexagonal prism with two corners of its top cut off: no polyhedron of regular faces has the form."""
    x = np.array(SHAPES["hexa_prism"].points)
    faces = [list(face) for face in SHAPES["hexa_prism"].faces]
    for corner in (7, 10):
        ring = []
        for face in faces:
            if corner in face:
                at = face.index(corner)
                for other in (face[at - 1], face[(at + 1) % len(face)]):
                    if other not in ring:
                        ring.append(other)
        ids = {other: len(x) + i for i, other in enumerate(ring)}
        x = np.vstack([x, [0.7 * x[corner] + 0.3 * x[other] for other in ring]])
        cut: dict[int, int] = {}
        for face in faces:
            if corner in face:
                at = face.index(corner)
                before, after = ids[face[at - 1]], ids[face[(at + 1) % len(face)]]
                face[at : at + 1] = [before, after]
                cut[after] = before
        first = next(iter(cut))
        faces.append([first, cut[first], cut[cut[first]]])
    used = sorted({point for face in faces for point in face})
    new = {old: i for i, old in enumerate(used)}
    return mesh_of(x[used], [[[new[point] for point in face] for face in faces]])


def test_cells_by_the_corner_model_keep_the_laws() -> None:
    mesh = cells_without_a_solid()
    quality = meshgauge.measure(mesh, metrics="shape")
    assert quality.polyhedra is not None
    assert quality.polyhedra.reference_kind[0] == 2  # by corners
    value = quality.values_of("shape")[0]
    assert 0.1 < value < 1.0
    assert shapes(mesh.replace(points=turned(np.asarray(mesh.points))))[0] == pytest.approx(value, rel=1e-12)
    assert shapes(mesh.replace(points=-np.asarray(mesh.points)))[0] == pytest.approx(-value, abs=0.5)
    assert shapes(mesh.replace(points=-np.asarray(mesh.points)))[0] < 0.0
    assert shapes(mesh.replace(points=np.asarray(mesh.points) * [9.0, 1.0, 1.0]))[0] < 0.6 * value
    # By hand: the corner of least mean ratio, with edges of the ideal corner from its cosines.
    poly = quality.polyhedra
    x, ratios = np.asarray(mesh.points), []
    assert mesh.polyhedra is not None
    starts = mesh.polyhedra.face_offsets
    faces = [mesh.polyhedra.face_points[starts[i] : starts[i + 1]].tolist() for i in range(len(starts) - 1)]
    for node in poly.node_points.tolist():
        around = [face for face in faces if node in face]
        ends = sorted({face[(face.index(node) + step) % len(face)] for face in around for step in (-1, 1)})
        assert len(around) == len(ends) == 3
        sizes = [len(next(f for f in around if {ends[i], ends[j]} <= set(f))) for i, j in ((0, 1), (1, 2), (0, 2))]
        (sides, _) = corner_cosines(np.array([sizes]), np.array([mesh.n_points]))
        (a, c, b) = sides[0]
        w = np.linalg.cholesky([[1, a, b], [a, 1, c], [b, c, 1]]).T
        m = (x[ends] - x[node]).T @ np.linalg.inv(w)
        ratios.append(3.0 * abs(np.linalg.det(m)) ** (2 / 3) / (m * m).sum())
    assert value == pytest.approx(min(ratios), rel=1e-10)


def test_hanging_nodes_are_left_out() -> None:
    points, cells = octree({(0, 0, 0): 1}, 2)
    mesh = mesh_of(points, cells)
    quality = meshgauge.measure(mesh, metrics=["shape"])
    assert quality.polyhedra is not None
    assert quality.polyhedra.node_is_hanging.any()
    np.testing.assert_allclose(quality.values_of("shape"), 1.0, atol=1e-12)
    longer = shapes(mesh.replace(points=np.asarray(mesh.points) * [8.0, 1.0, 1.0]))
    np.testing.assert_allclose(longer, 3 * 8 ** (2 / 3) / (64 + 2), rtol=1e-12)


def test_a_broken_cell_has_none() -> None:
    one = solids()[0]
    assert np.isnan(shapes(mesh_of(one.points, [one.faces[:-1]]))[0])
