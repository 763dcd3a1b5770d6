"""Verdict, through VTK, as an oracle: where it agrees, and where it is known not to (a change of VTK is noticed)."""

from __future__ import annotations

from math import inf, nan

import numpy as np
import oracle
import pytest
from numpy.typing import NDArray

import meshgauge
from meshgauge.cells import BY_NAME, CELL_TYPES, SHAPES
from meshgauge.errors import MetricError
from meshgauge.quality.metrics import METRICS, Metric
from meshgauge.quality.metrics.verdict_library import _ask, verdict_quality
from meshgauge.surface_cells import SURFACE_SHAPES, SURFACE_TYPES

pytest.importorskip("vtkmodules.vtkFiltersVerdict")

VERDICT_ROWS = [(row, shape) for row in METRICS.values() if row.source == "verdict" for shape in row.shapes or ()]
rows = pytest.mark.parametrize(
    ("row", "shape"), VERDICT_ROWS, ids=[f"{row.name}-{shape}" for row, shape in VERDICT_ROWS]
)

KNOWN = {**SHAPES, **SURFACE_SHAPES}
N = 4000
HEXAHEDRON_SIGNS = np.array([(x, y, z) for z in (-1, 1) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
FLAT = (1.0, 1.0, 0.0)


def cells_of(shape: str, n: int = N, seed: int = 0) -> NDArray[np.float64]:
    return oracle.random_cells(shape, KNOWN[shape].points, n, seed)


def one_by_one(x: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points and connectivity of cells that share no point."""
    return np.ascontiguousarray(x.reshape(-1, 3)), np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])


def verdict(shape: str, x: NDArray[np.float64], measure: str) -> NDArray[np.float64]:
    return verdict_quality(*one_by_one(x), BY_NAME[shape].vtk_id, measure)


def raw_verdict(shape: str, x: NDArray[np.float64], measure: str) -> NDArray[np.float64]:
    """As VTK gives it, nothing masked."""
    return _ask(*one_by_one(x), BY_NAME[shape].vtk_id, measure)


# --- the rows ---------------------------------------------------------------------------------------------------------


@rows
def test_ideal_value(row: Metric, shape: str) -> None:
    # The condition of wedges rounds a constant of its ideal cell.
    rounded = shape == "wedge" and row.name in (
        "verdict_condition",
        "verdict_max_aspect_frobenius",
        "verdict_mean_aspect_frobenius",
    )
    value = verdict(shape, np.array([KNOWN[shape].points]), row.name)
    assert value == pytest.approx(row.standard(shape).ideal, abs=4e-6 if rounded else 1e-12)
    lowest, highest = row.standard(shape).acceptable
    assert lowest - 1e-12 <= value[0] <= highest + (4e-6 if rounded else 1e-12)


@rows
def test_random_cells_are_in_range_or_undefined(row: Metric, shape: str) -> None:
    values = verdict(shape, cells_of(shape), row.name)
    defined = values[~np.isnan(values)]
    assert len(defined) > N / 6
    assert defined.min() >= row.range[0] - 1e-12
    assert defined.max() <= row.range[1] + 1e-12


@rows
def test_no_mark_of_verdict_is_a_value(row: Metric, shape: str) -> None:
    ideal = np.array(KNOWN[shape].points)
    spoilt = [ideal.copy() for _ in range(5)]
    spoilt[0] *= FLAT
    spoilt[1][:] = spoilt[1][0]
    spoilt[2][1] = spoilt[2][0]
    spoilt[3][0] = nan
    spoilt[4][-1, 1] = inf
    values = verdict(shape, np.array(spoilt), row.name)
    assert np.isnan(values[3:]).all()
    defined = values[~np.isnan(values)]
    assert (np.abs(defined) < 1e6).all()


@rows
def test_any_unit_of_length(row: Metric, shape: str) -> None:
    x = cells_of(shape, 200)
    expected = verdict(shape, x, row.name)
    for scale in (1e-30, 1e-12, 1e9, 1e60):
        # Products of rounded lengths: what is huge or nearly 0 is less exact; a scale that is no power of two rounds.
        got = verdict(shape, x * scale, row.name) / scale ** min(row.length_power, KNOWN[shape].dimension)
        np.testing.assert_allclose(got, expected, rtol=1e-5, atol=1e-9, equal_nan=True, err_msg=f"scale {scale}")


def test_arrays_are_taken_as_they_come() -> None:
    x = cells_of("hexahedron", 50)
    points, cells = one_by_one(x)
    expected = verdict_quality(points, cells, 12, "shape")
    points.flags.writeable = cells.flags.writeable = False
    np.testing.assert_array_equal(verdict_quality(points, cells, 12, "verdict_shape"), expected)
    np.testing.assert_array_equal(verdict_quality(points, cells.astype(np.int32), 12, "shape"), expected)
    narrow = points.astype(np.float32)
    np.testing.assert_array_equal(
        verdict_quality(narrow, cells, 12, "shape"), verdict_quality(narrow.astype(float), cells, 12, "shape")
    )
    assert verdict_quality(points, cells[:0], 12, "shape").shape == (0,)


@pytest.mark.parametrize("name", ["voxel", "hexahedron20", "wedge15", "pyramid13", "tetra10"])
def test_other_types_are_measured_at_their_corners(name: str) -> None:
    row = BY_NAME[name]
    assert row.shape is not None
    assert row.n_nodes is not None
    x = cells_of(row.shape.name, 50)
    all_nodes = np.full((50, row.n_nodes, 3), 7.0)
    all_nodes[:, list(row.corners)] = x
    points, cells = one_by_one(all_nodes)
    np.testing.assert_array_equal(
        verdict_quality(points, cells, row.vtk_id, "volume"), verdict(row.shape.name, x, "volume")
    )


def test_what_verdict_does_not_know_is_an_error() -> None:
    points, cells = one_by_one(cells_of("hexahedron", 1))
    with pytest.raises(MetricError, match=r"no Verdict measure 'beauty'; there are .*volume"):
        verdict_quality(points, cells, 12, "beauty")
    with pytest.raises(MetricError, match="skew is not defined for tetra; it is for hexahedron"):
        verdict_quality(points, cells[:, :4], 10, "skew")
    for vtk_id in set(range(256)) - {i for i, row in CELL_TYPES.items() if row.shape}:
        with pytest.raises(MetricError, match="volume is not defined for"):
            verdict_quality(points, cells, vtk_id, "volume")


# --- where it agrees --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", ["tetra", "wedge", "hexahedron"])
def test_scaled_jacobian_is_jens_for_valid_cells_below_k(shape: str) -> None:
    x = cells_of(shape)
    quality = oracle.cell_jens(shape, x)
    expected = quality
    if shape == "hexahedron":
        # Verdict takes the centre as a ninth corner. Among 4 400 valid random hexahedra it is the worst in one.
        axes = np.einsum("ca,ncb->nab", HEXAHEDRON_SIGNS, x)
        expected = np.minimum(quality, np.linalg.det(axes / np.linalg.norm(axes, axis=-1)[..., None]))
    agree = (quality > 0) & (quality < SHAPES[shape].k)
    assert agree.sum() > N / 10
    np.testing.assert_allclose(verdict(shape, x, "scaled_jacobian")[agree], expected[agree], atol=1e-12)


def test_scaled_jacobian_is_jens_for_inverted_tetrahedra() -> None:
    x = cells_of("tetra")
    quality = oracle.cell_jens("tetra", x)
    agree = (quality < 0) & (quality > -SHAPES["tetra"].k)
    assert agree.sum() > N / 4
    np.testing.assert_allclose(verdict("tetra", x, "scaled_jacobian")[agree], quality[agree], atol=1e-12)


def test_aspect_gamma_is_the_inverse_of_unsigned_arg_s() -> None:
    x = cells_of("tetra")
    ours = np.abs(oracle.scaled_aspect_ratio_gamma(x))
    np.testing.assert_allclose(verdict("tetra", x, "aspect_gamma") * ours, 1, atol=1e-10)


def lengths(shape: str, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of the edges: ``(n_cells, n_edges)``."""
    a, b = np.array(SHAPES[shape].edges).T
    return np.asarray(np.linalg.norm(x[:, a] - x[:, b], axis=-1))


def tetra_volumes(x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.linalg.det(x[:, 1:] - x[:, :1]) / 6)


def face_vectors(shape: str, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outward normals of triangles, as long as twice their area: ``(n_faces, n_cells, 3)``."""
    return np.array([np.cross(x[:, b] - x[:, a], x[:, c] - x[:, a]) for a, b, c in SHAPES[shape].faces])


def skew_of_angles(shape: str, x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest deviation of a face's angle from 60 or 90 degrees, over the most that there can be."""
    worst = np.zeros(len(x))
    for face in SHAPES[shape].faces:
        corners = x[:, face]
        one, other = np.roll(corners, 1, axis=1) - corners, np.roll(corners, -1, axis=1) - corners
        cosines = (one * other).sum(-1) / np.linalg.norm(one, axis=-1) / np.linalg.norm(other, axis=-1)
        angles, ideal = np.degrees(np.arccos(np.clip(cosines, -1, 1))), 60.0 if len(face) == 3 else 90.0
        deviations = np.maximum((angles - ideal) / (180 - ideal), (ideal - angles) / ideal)
        worst = np.maximum(worst, deviations.max(axis=1))
    return worst


@pytest.mark.parametrize("shape", ["tetra", "wedge"])
def test_edge_ratio_is_longest_over_shortest(shape: str) -> None:
    x = cells_of(shape)
    edges = lengths(shape, x)
    np.testing.assert_allclose(verdict(shape, x, "edge_ratio"), edges.max(1) / edges.min(1), rtol=1e-12)


def test_spheres_of_tetrahedra() -> None:
    x = cells_of("tetra")
    volumes, normals = tetra_volumes(x), face_vectors("tetra", x)
    inradius = 6 * volumes / np.linalg.norm(normals, axis=-1).sum(axis=0)
    np.testing.assert_allclose(verdict("tetra", x, "inradius"), inradius, rtol=1e-9)
    a, b, c = (x[:, m] - x[:, 0] for m in (1, 2, 3))
    squares = [(v * v).sum(1)[:, None] for v in (a, b, c)]
    circumcentre = squares[0] * np.cross(b, c) + squares[1] * np.cross(c, a) + squares[2] * np.cross(a, b)
    circumradius = np.linalg.norm(circumcentre, axis=1) / (12 * np.abs(volumes))
    regular = 8 / 27 * np.sqrt(3) * circumradius**3
    np.testing.assert_allclose(verdict("tetra", x, "equivolume_skew"), 1 - np.abs(volumes) / regular, atol=1e-9)
    # Of the pieces that the midpoints cut off at the corners the inradius is half that of the cell, so is the radius.
    assert (verdict("tetra", x, "normalized_inradius") <= 3 * inradius / circumradius + 1e-9).all()


def test_mean_ratio_is_arg_s() -> None:
    x = cells_of("tetra")
    np.testing.assert_allclose(verdict("tetra", x, "mean_ratio"), oracle.scaled_aspect_ratio_gamma(x), atol=1e-12)


def test_squish_index_is_of_the_normals() -> None:
    x = cells_of("tetra")
    ways = np.array([x[:, face].mean(axis=1) - x.mean(axis=1) for face in SHAPES["tetra"].faces])
    normals = face_vectors("tetra", x)
    cosines = (normals * ways).sum(-1) / np.linalg.norm(normals, axis=-1) / np.linalg.norm(ways, axis=-1)
    np.testing.assert_allclose(verdict("tetra", x, "squish_index"), 1 - cosines.min(axis=0), atol=1e-9)


@pytest.mark.parametrize("shape", ["pyramid", "wedge", "hexahedron"])
def test_equiangle_skew_is_of_the_angles_of_faces_that_are_not_concave(shape: str) -> None:
    x = cells_of(shape)
    got, expected = verdict(shape, x, "equiangle_skew"), skew_of_angles(shape, x)
    is_convex = got <= 1
    assert N / 10 < is_convex.sum() < N
    np.testing.assert_allclose(got[is_convex], expected[is_convex], atol=1e-7)
    assert (got >= expected - 1e-7).all()


def test_equiangle_skew_of_tetrahedra_is_of_dihedral_angles_too() -> None:
    x = cells_of("tetra")
    normals = face_vectors("tetra", x)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    dihedral = [180 - np.degrees(np.arccos((normals[a] * normals[b]).sum(1))) for a in range(4) for b in range(a)]
    ideal = np.degrees(np.arccos(1 / 3))
    of_edges = np.maximum((np.array(dihedral) - ideal) / (180 - ideal), (ideal - np.array(dihedral)) / ideal)
    expected = np.maximum(of_edges.max(axis=0), skew_of_angles("tetra", x))
    np.testing.assert_allclose(verdict("tetra", x, "equiangle_skew"), expected, atol=1e-7)


def test_largest_stretch_is_of_the_quadrilaterals() -> None:
    x = cells_of("wedge")
    expected = np.zeros(len(x))
    for face in (face for face in SHAPES["wedge"].faces if len(face) == 4):
        corners = x[:, face]
        sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=-1)
        diagonals = np.linalg.norm(corners[:, :2] - corners[:, 2:], axis=-1)
        expected = np.maximum(expected, np.sqrt(2) * sides.min(axis=1) / diagonals.max(axis=1))
    np.testing.assert_allclose(verdict("wedge", x, "max_stretch"), expected, rtol=1e-12)


def test_mean_aspect_frobenius_is_of_the_corner_tetrahedra() -> None:
    x = cells_of("wedge")
    corners = [x[:, triple] for triple in SHAPES["wedge"].triples]
    expected = np.mean([raw_verdict("tetra", corner, "aspect_frobenius") for corner in corners], axis=0) / 1.16477
    np.testing.assert_allclose(verdict("wedge", x, "mean_aspect_frobenius"), expected.clip(1), rtol=1e-9)


def test_nodal_jacobian_ratio_is_least_over_greatest() -> None:
    x = cells_of("hexahedron")
    determinants = np.array([np.linalg.det(x[:, [i, j, k]] - x[:, [a]]) for a, i, j, k in SHAPES["hexahedron"].triples])
    least, greatest = determinants.min(axis=0), determinants.max(axis=0)
    got = verdict("hexahedron", x, "nodal_jacobian_ratio")
    np.testing.assert_array_equal(np.isnan(got), greatest <= 0)
    np.testing.assert_allclose(got[greatest > 0], (least / greatest)[greatest > 0], rtol=1e-6, atol=1e-9)


def test_wedges_are_in_our_order() -> None:
    ideal = np.array([SHAPES["wedge"].points])
    assert verdict("wedge", ideal, "volume") == pytest.approx(np.sqrt(3) / 4)
    assert verdict("wedge", ideal[:, [3, 4, 5, 0, 1, 2]], "volume") == pytest.approx(-np.sqrt(3) / 4)


# --- known disagreements, each as VTK gives it today ------------------------------------------------------------------


def test_disagreement_flat_cells_score_1e30() -> None:
    flat = {name: np.array([SHAPES[name].points]) * FLAT for name in SHAPES}
    assert raw_verdict("hexahedron", flat["hexahedron"], "scaled_jacobian") == 1e30
    assert raw_verdict("wedge", flat["wedge"], "scaled_jacobian") == -1e30
    assert raw_verdict("tetra", flat["tetra"], "aspect_gamma") == 1e30
    assert oracle.cell_jens("hexahedron", flat["hexahedron"]) == 0


def test_disagreement_inverted_and_tangled_pyramids_score_zero() -> None:
    x = cells_of("pyramid")
    invalid = oracle.cell_jens("pyramid", x) < 0
    assert N / 4 < invalid.sum() < N
    assert (raw_verdict("pyramid", x, "scaled_jacobian")[invalid] == 0).all()
    assert np.isnan(verdict("pyramid", x, "scaled_jacobian")[invalid]).all()


def test_disagreement_pyramids_are_cut_into_tetrahedra() -> None:
    """Twice the least J_S of the four tetrahedra that the base's diagonals cut off, folded back at 1."""
    x = cells_of("pyramid")
    valid = oracle.cell_jens("pyramid", x) > 0
    tetras = ([0, 1, 2, 4], [1, 2, 3, 4], [2, 3, 0, 4], [3, 0, 1, 4])
    worst = 2 * np.min([oracle.node_scaled_jacobian("tetra", x[:, t]).min(axis=1) for t in tetras], axis=0)
    expected = np.where(worst > 1, 2 - worst, worst)
    np.testing.assert_allclose(verdict("pyramid", x, "scaled_jacobian")[valid], expected[valid], atol=1e-12)
    # The report's rectangular pyramid.
    rectangular = np.array([[(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0), (0, 1, 0)]], float)
    assert verdict("pyramid", rectangular, "scaled_jacobian") == pytest.approx(1 / np.sqrt(3))
    assert oracle.cell_jens("pyramid", rectangular) == pytest.approx(1 / np.sqrt(6))


@pytest.mark.parametrize("shape", ["wedge", "hexahedron"])
def test_disagreement_inverted_cells_score_the_worst_corner(shape: str) -> None:
    """Verdict takes the least of all corners (over k), we the greatest of the negative ones."""
    x = cells_of(shape)
    inverted = oracle.cell_jens(shape, x) < 0
    worst = oracle.node_scaled_jacobian(shape, x).min(axis=1) / SHAPES[shape].k
    if shape == "hexahedron":
        axes = np.einsum("ca,ncb->nab", HEXAHEDRON_SIGNS, x)
        worst = np.minimum(worst, np.linalg.det(axes / np.linalg.norm(axes, axis=-1)[..., None]))
    np.testing.assert_allclose(verdict(shape, x, "scaled_jacobian")[inverted], worst[inverted], atol=1e-12)


@pytest.mark.parametrize("shape", ["tetra", "wedge"])
def test_disagreement_no_penalty_above_k(shape: str) -> None:
    """A corner sharper than the ideal one costs J_ENS, not Verdict."""
    x = cells_of(shape)
    quality, k = oracle.cell_jens(shape, x), SHAPES[shape].k
    above = quality >= k
    worst = oracle.node_scaled_jacobian(shape, x).min(axis=1) / k
    np.testing.assert_allclose(verdict(shape, x, "scaled_jacobian")[above], worst[above], atol=1e-12)
    assert (verdict(shape, x, "scaled_jacobian")[above] - quality[above] > 1e-3).any()


def test_disagreement_nan_is_skipped() -> None:
    cube = np.array([SHAPES["hexahedron"].points])
    cube[0, 0] = nan
    assert raw_verdict("hexahedron", cube, "jacobian") == pytest.approx(1)
    assert np.isnan(verdict("hexahedron", cube, "jacobian"))


def test_disagreement_the_edge_ratio_of_hexahedra_passes_over_edges() -> None:
    """Which is why there is no such metric."""
    missed = []
    for a, b in SHAPES["hexahedron"].edges:
        x = np.array([SHAPES["hexahedron"].points])
        x[0, b] = x[0, a] + 0.1 * (x[0, b] - x[0, a])
        edges = lengths("hexahedron", x)
        if raw_verdict("hexahedron", x, "edge_ratio")[0] < edges.max() / edges.min() - 1e-9:
            missed.append((a, b))
    assert len(missed) == 3
    assert not METRICS["verdict_edge_ratio"].is_defined_for("hexahedron")


def test_disagreement_an_edge_of_length_0_has_no_angle() -> None:
    flat = np.array([SHAPES["hexahedron"].points]) * FLAT
    assert raw_verdict("hexahedron", flat, "equiangle_skew") == pytest.approx(0, abs=1e-12)
    assert np.isnan(verdict("hexahedron", flat, "equiangle_skew"))


def test_disagreement_short_lengths_are_zero() -> None:
    for shape, measure, scale, mark in (
        ("tetra", "scaled_jacobian", 1e-16, 1e30),
        ("hexahedron", "oddy", 1e-8, 1e30),
        ("pyramid", "shape", 1e-8, 0),
    ):
        tiny = np.array([SHAPES[shape].points]) * scale
        assert raw_verdict(shape, tiny, measure) == mark
        ideal = METRICS[f"verdict_{measure}"].standard(shape).ideal
        assert verdict(shape, tiny, measure) == pytest.approx(ideal, abs=1e-12)


def test_disagreement_tetra_distortion_is_one_for_every_cell() -> None:
    assert (raw_verdict("tetra", cells_of("tetra"), "distortion") == 1).all()


# --- surface cells ----------------------------------------------------------------------------------------------------


def corner_angles(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """``(n_cells, n_corners)`` in degrees, at most 180."""
    one, other = np.roll(x, 1, axis=1) - x, np.roll(x, -1, axis=1) - x
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other), axis=-1), (one * other).sum(-1)))


def measured(shape: str, x: NDArray[np.float64], *names: str) -> list[NDArray[np.float64]]:
    points, cells = one_by_one(x)
    quality = meshgauge.measure(meshgauge.Mesh.from_arrays(points, {shape: cells}), metrics=names)
    return [quality.values_of(name) for name in names]


@pytest.mark.parametrize("shape", ["triangle", "quad"])
def test_lengths_and_angles_of_surface_cells(shape: str) -> None:
    x = cells_of(shape)
    sides = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=-1)
    np.testing.assert_allclose(verdict(shape, x, "edge_ratio"), sides.max(1) / sides.min(1), rtol=1e-12)
    np.testing.assert_allclose(measured(shape, x, "edge_ratio")[0] * verdict(shape, x, "edge_ratio"), 1.0, rtol=1e-12)
    angles, convex = corner_angles(x), measured(shape, x, "scaled_jacobian")[0] > 0
    assert convex.sum() > N / 3
    np.testing.assert_allclose(verdict(shape, x, "min_angle"), angles.min(1), atol=1e-6)
    np.testing.assert_allclose(verdict(shape, x, "max_angle")[convex], angles.max(1)[convex], atol=1e-6)
    ideal = 60.0 if shape == "triangle" else 90.0
    skew = np.maximum((angles.max(1) - ideal) / (180 - ideal), (ideal - angles.min(1)) / ideal)
    np.testing.assert_allclose(verdict(shape, x, "equiangle_skew")[convex], skew[convex], atol=1e-7)


def test_triangles_are_those_of_their_circles() -> None:
    x = cells_of("triangle")
    sides = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=-1)
    area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    np.testing.assert_allclose(verdict("triangle", x, "area"), area, rtol=1e-12)
    inradius, circumradius = 2 * area / sides.sum(1), sides.prod(1) / (4 * area)
    np.testing.assert_allclose(verdict("triangle", x, "radius_ratio"), circumradius / (2 * inradius), rtol=1e-9)
    np.testing.assert_allclose(verdict("triangle", x, "normalized_inradius"), 2 * inradius / circumradius, rtol=1e-9)
    expected = sides.max(1) / (2 * np.sqrt(3) * inradius)
    np.testing.assert_allclose(verdict("triangle", x, "aspect_ratio"), expected, rtol=1e-9)
    ours, theirs = measured("triangle", x, "shape", "verdict_shape")
    np.testing.assert_allclose(np.abs(ours), theirs, rtol=1e-9)


def test_quadrilaterals_have_our_warpage_and_scaled_jacobian() -> None:
    x = cells_of("quad")
    ours, theirs = measured("quad", x, "warpage", "verdict_warpage")
    np.testing.assert_allclose(ours, theirs, atol=1e-9)
    assert ours.max() > 1 > 0.01 > ours.min()
    ours, theirs = measured("quad", x, "scaled_jacobian", "verdict_scaled_jacobian")
    np.testing.assert_allclose(ours[ours > 0], theirs[ours > 0], atol=1e-9)
    assert (theirs[ours < 0] < 0).all()


@pytest.mark.parametrize("name", ["pixel", "quad8", "quad9", "triangle6"])
def test_other_surface_cells_are_measured_at_their_corners(name: str) -> None:
    row = SURFACE_TYPES[BY_NAME[name].vtk_id]
    assert row.shape is not None
    assert row.n_nodes is not None
    x = cells_of(row.shape.name, 50)
    all_nodes = np.concatenate([x, x[:, :1].repeat(row.n_nodes - x.shape[1], axis=1)], axis=1)
    all_nodes[:, list(row.corners)] = x
    np.testing.assert_array_equal(
        verdict_quality(*one_by_one(all_nodes), row.vtk_id, "area"), verdict(row.shape.name, x, "area")
    )


def test_polygons_and_faces_of_solids_have_none() -> None:
    mesh = meshgauge.Mesh.from_arrays(
        np.vstack([SHAPES["tetra"].points, [(5, 0, 0), (6, 0, 0), (5, 1, 0)]]),
        [("tetra", [range(4)]), ("triangle", [(4, 5, 6)])],
    )
    values = meshgauge.measure(mesh, metrics="verdict_shape").values_of("verdict_shape")
    assert values == pytest.approx([1.0, nan], nan_ok=True)
    assert not METRICS["verdict_area"].is_defined_for("polygon")
    assert not METRICS["verdict_area"].is_defined_for("tetra")


def test_disagreement_triangle_distortion_is_one_and_warped_quads_have_a_radius_ratio_below_one() -> None:
    assert (raw_verdict("triangle", cells_of("triangle"), "distortion") == 1).all()
    assert raw_verdict("quad", cells_of("quad"), "radius_ratio").min() < 0.95
    for shape, measure in (("triangle", "distortion"), ("quad", "radius_ratio")):
        assert not METRICS[f"verdict_{measure}"].is_defined_for(shape)
