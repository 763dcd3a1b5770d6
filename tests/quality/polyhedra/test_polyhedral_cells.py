"""Polyhedra as files give them: shared faces, face streams, and real meshes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from polyhedral_meshes import CUBE, CUBE_FACES, TETRA_FACES, measured

import meshgauge
from meshgauge.kernels.polyhedra.nodes import winds_once
from meshgauge.mesh.polyhedra import Polyhedra
from meshgauge.quality.polyhedra import ReferenceKind, measure_polyhedra
from meshgauge.quality.reference import antiprism, solid


def test_faces_that_two_cells_share_are_turned_for_the_second() -> None:
    points = [*CUBE, (0, 0, 2), (1, 0, 2), (1, 1, 2), (0, 1, 2)]
    upper = [tuple(i + 4 for i in face) for face in CUBE_FACES[1:]]
    faces = [CUBE_FACES[1], *(f for i, f in enumerate(CUBE_FACES) if i != 1), *upper]
    offsets = np.cumsum([0] + [len(face) for face in faces])
    ids = np.array([i for face in faces for i in face])
    shared_face = Polyhedra.from_owner_neighbour(offsets, ids, [0] * 6 + [1] * 5, [1])
    assert shared_face.face_points is ids
    for of in (shared_face, shared_face.with_own_faces()):
        quality = measure_polyhedra(np.array(points, float), of, slice(0, 2))
        assert quality.values.tolist() == [1.0, 1.0]
        assert not quality.faults.any()
    assert shared_face.with_own_faces().flipped is None


def test_vtk_face_stream() -> None:
    stream = [4, *(v for face in TETRA_FACES for v in (3, *face)), 6, *(v for face in CUBE_FACES for v in (4, *face))]
    of = Polyhedra.from_face_stream([0, -1, 17], stream)
    assert np.diff(of.cell_offsets).tolist() == [4, 0, 6]
    quality = measure_polyhedra(np.array(CUBE, float), of, np.array([2]))
    assert quality.values.tolist() == [1.0]


def test_node_values_in_the_order_of_a_connectivity() -> None:
    one = solid("J12")
    quality = measured(one.points, one.faces)
    connectivity = np.array([4, 3, 2, 1, 0, 0])
    k = quality.along(np.array([0, 5, 6]), connectivity, quality.node_k)
    np.testing.assert_allclose(k[:5], one.k[::-1], rtol=1e-12)
    assert np.isnan(k[5])


def test_against_the_prototype(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Voronoi cells, every one with a form of its own; written apart from the package."""
    pytest.importorskip("scipy")
    monkeypatch.syspath_prepend(str(shared / "prototypes" / "poly"))
    import polylib
    import voro

    cells = voro.periodic_cells(np.random.default_rng(2).random((12, 3)))
    for points, faces, _ in cells:
        expected = polylib.quality(points, faces, reduce=False)
        quality = measured(points, faces)
        np.testing.assert_allclose(quality.values[0], expected["Eq"], rtol=1e-9)
        assert (quality.reference_kind[0] == ReferenceKind.REGULAR_FACED) == (expected["kind"] == "regular-faced")
    one = antiprism(5)
    shaken = one.points + 0.05 * np.random.default_rng(0).standard_normal(one.points.shape)
    expected = polylib.quality(shaken, [list(face) for face in one.faces], reduce=False)
    np.testing.assert_allclose(measured(shaken, one.faces).values[0], expected["Eq"], rtol=1e-9)


def test_a_real_mesh_of_perpendicular_bisectors(shared: Path) -> None:
    mesh = meshgauge.read(shared / "meshes/GEOS-DEV+GEOS/inputFiles/singlePhaseFlow/pebi3d_with_properties.vtu")
    assert mesh.polyhedra is not None
    quality = measure_polyhedra(mesh.points, mesh.polyhedra, slice(0, mesh.n_cells))
    assert np.isfinite(quality.values).all()
    assert quality.is_star_shaped.all()
    np.testing.assert_array_equal(np.diff(quality.node_offsets), np.diff(mesh.offsets))


def test_a_link_winds_once_if_it_turns_by_less_than_half_a_turn_about_its_first_neighbour() -> None:
    """Against angles in a plane across that neighbour, of links to all sides."""
    rng = np.random.default_rng(0)
    sizes = rng.integers(4, 8, 200)
    starts = np.cumsum(sizes) - sizes
    points = np.concatenate([np.zeros((1, 3)), rng.normal(size=(int(sizes.sum()), 3))])
    points.flags.writeable = False  # as those of a mesh
    out = np.zeros(len(sizes), np.uint8)
    link_points = np.arange(1, len(points))
    winds_once(points, np.zeros(len(sizes), np.int64), starts, sizes, out, link_points)
    for start, size, once in zip(starts, sizes, out, strict=True):
        first, *others = points[1 + start : 1 + start + size]
        u, v, _ = np.linalg.svd(first[:, None])[0].T[[1, 2, 0]]
        angles = np.unwrap([np.arctan2(x @ v, x @ u) for x in others])
        assert once == (np.abs(np.diff(angles)).sum() < np.pi)
