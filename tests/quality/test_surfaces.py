"""Surface cells: their values are those of the prism that stands on them, with an exact sign."""

from __future__ import annotations

from fractions import Fraction
from math import cos, pi, sin, sqrt

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, Status
from meshgauge.cells import BY_NAME
from meshgauge.errors import MeshError
from meshgauge.kernels.cells import driver
from meshgauge.kernels.certificate.bounds import Validity
from meshgauge.surface_cells import SURFACE_TYPES

law = pytest.mark.usefixtures("path")

PRISMS = {3: "wedge", 4: "hexahedron", 5: "penta_prism", 6: "hexa_prism"}
NAMES = {3: "triangle", 4: "quad"}


def regular(n: int) -> np.ndarray:
    return np.array([(cos(2 * pi * m / n), sin(2 * pi * m / n), 0.0) for m in range(n)])


def moved(x: np.ndarray, along_x: float, along_z: float) -> np.ndarray:
    return np.asarray(x + np.array([along_x, 0, along_z]))


def turned(x: np.ndarray, seed: int = 0) -> np.ndarray:
    """The points turned about some axis, and moved."""
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q = q * np.sign(np.diag(r))
    return x @ (q * np.sign(np.linalg.det(q))).T + (1, 2, 3)


def cells(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points and ids of cells ``(n, n_nodes, 3)`` that share none."""
    return x.reshape(-1, x.shape[2]), np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])


def noisy(n: int, count: int, noise: float, *, warp: float = 0.0, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return np.asarray(regular(n) + rng.normal(size=(count, n, 3)) * (noise, noise, warp))


def jens(x: np.ndarray, name: str = "", **options: bool) -> np.ndarray:
    return meshgauge.jens(*cells(x), name or NAMES.get(x.shape[1], "polygon"), **options)


def newell(x: np.ndarray) -> np.ndarray:
    return np.cross(x, np.roll(x, -1, axis=1)).sum(axis=1) / 2


@law
@pytest.mark.parametrize("n", range(3, 13))
def test_regular_ones_are_ideal(n: int) -> None:
    assert jens(regular(n)[None], "polygon") == pytest.approx(1.0, abs=1e-14)
    assert jens(turned(regular(n))[None], "polygon") == pytest.approx(1.0, abs=1e-14)
    assert jens(regular(n)[None, :, :2]) == pytest.approx(1.0, abs=1e-14)


@law
@pytest.mark.parametrize("n", PRISMS)
@pytest.mark.parametrize("warp", [0.0, 0.4])
def test_it_is_the_value_of_the_prism(n: int, warp: float) -> None:
    x = noisy(n, 200, 0.3, warp=warp)
    x = np.stack([turned(cell, 3) for cell in x])
    normal = newell(x)
    height = normal / np.linalg.norm(normal, axis=1)[:, None]
    prisms = np.concatenate([x, x + height[:, None]], axis=1)
    expected = meshgauge.jens(*cells(prisms), PRISMS[n], nodes=True)[:, :n]
    np.testing.assert_allclose(jens(x, nodes=True), expected, atol=1e-9)
    assert (expected < 0).any() == (n > 3)


@law
def test_warping_costs_little() -> None:
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    lifted = np.repeat(square[None], 4, axis=0)
    lifted[:, 2, 2] = (0.1, 0.2, 0.5, 1.0)
    np.testing.assert_allclose(jens(lifted), (0.998, 0.990, 0.943, 0.816), atol=5e-4)


@law
def test_clockwise_is_inverted_in_a_plane_and_not_in_space() -> None:
    both = np.stack([regular(4), moved(regular(4)[::-1], 5, 0), moved(regular(4), 9, 0)])
    np.testing.assert_allclose(jens(both), (1, -1, 1), atol=1e-14)
    np.testing.assert_allclose(jens(both + np.arange(12).reshape(3, 4, 1) * (0, 0, 1e-3)), 1, atol=1e-4)
    # Most of the area decides from which side a plane in space is seen; two coordinates are seen from above.
    np.testing.assert_allclose(jens(both[:, ::-1]), (1, -1, 1), atol=1e-14)
    np.testing.assert_allclose(jens(both[:, ::-1, :2]), (-1, 1, -1), atol=1e-14)


def test_a_mesh_says_from_which_side_it_is_seen() -> None:
    def mesh(points: np.ndarray) -> Mesh:
        return Mesh.from_arrays(points, {"triangle": [(0, 2, 1)]})

    flat = moved(regular(3), 0, 7)
    assert (mesh(flat).up, mesh(flat).dimension) == (-1, 2)
    assert "seen from -z" in mesh(flat).notes[0]
    assert mesh(flat[:, :2]).up == 1
    assert mesh(turned(flat)).up == 0
    part = Mesh.from_arrays(np.concatenate([flat, flat + 9]), {"triangle": [(0, 1, 2), (3, 5, 4)]})
    assert part.up == 0
    both = Mesh.from_arrays(np.concatenate([flat, 0.5 * flat + (9, 9, 3.5)]), {"triangle": [(0, 1, 2), (3, 5, 4)]})
    assert (both.up, both[[1]].up) == (1, 1)
    assert meshgauge.measure(both[[1]]).status.tolist() == [Status.INVERTED]
    with pytest.raises(MeshError, match="expected"):
        Mesh.from_arrays(np.zeros((4, 2)), {"tetra": [(0, 1, 2, 3)]})
    with pytest.raises(MeshError, match="expected"):
        meshgauge.jens(np.zeros((4, 2)), [(0, 1, 2, 3)], "tetra")


@law
@pytest.mark.parametrize("name", ["triangle", "quad"])
def test_it_is_verdicts_scaled_jacobian(name: str) -> None:
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
    from vtkmodules.vtkFiltersVerdict import vtkMeshQuality

    from meshgauge.kernels.cells.aggregate import fold

    n = {"triangle": 3, "quad": 4}[name]
    x = noisy(n, 400, 0.35, warp=0.3, seed=5)
    ours = meshgauge.scaled_jacobian(*cells(x), name, nodes=True)
    grid, points = vtkUnstructuredGrid(), vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(x.reshape(-1, 3)), deep=True))
    grid.SetPoints(points)
    for cell in range(len(x)):
        grid.InsertNextCell(SURFACE_TYPES[5 if n == 3 else 9].vtk_id, n, range(cell * n, cell * n + n))
    quality = vtkMeshQuality()
    quality.SetInputData(grid)
    quality.SetTriangleQualityMeasureToScaledJacobian()
    quality.SetQuadQualityMeasureToScaledJacobian()
    quality.Update()
    theirs = vtk_to_numpy(quality.GetOutput().GetCellData().GetArray("Quality"))
    few = (ours < 0).sum(axis=1) <= 1
    if n == 3:  # Verdict divides by the value of the ideal one, and the largest corner may lie beyond
        theirs = theirs * sqrt(3) / 2
    np.testing.assert_allclose(fold(ours)[few], theirs[few], atol=1e-10)
    assert few.mean() > 0.9


@law
@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
def test_the_sign_is_exact_in_a_plane(scale: float) -> None:
    # Three points on a line but for the last bit: floating arithmetic does not tell.
    rng = np.random.default_rng(7)
    start, step = rng.uniform(0.5, 1, (200, 2)), rng.uniform(-1, 1, (200, 2))
    share = rng.uniform(0.2, 3, (200, 2))
    x = np.stack([start, start + share[:, :1] * step, start + share[:, 1:] * step], axis=1) * scale
    values = meshgauge.jens(*cells(x), "triangle")
    for (a, b, c), value in zip(x.tolist(), values.tolist(), strict=True):
        u, v, w = ([Fraction(t) for t in p] for p in (a, b, c))
        det = (v[0] - u[0]) * (w[1] - u[1]) - (v[1] - u[1]) * (w[0] - u[0])
        assert np.sign(value) == (det > 0) - (det < 0)
    assert len(set(np.sign(values))) > 1


@pytest.mark.parametrize("up", [0, 1, -1])
@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 63, 64, 65, 72, 129])
@pytest.mark.parametrize("n", [3, 4])
def test_kernels_take_any_number_of_cells(n: int, count: int, up: int) -> None:
    points, ids = cells(noisy(n, 129, 0.4, warp=0.0 if up else 0.4)[:count])
    row, out = SURFACE_TYPES[BY_NAME[NAMES[n]].vtk_id], np.empty((2, count))
    with np.errstate(all="ignore"):
        for way, compiled in enumerate((False, True)):
            driver.cell_jens(points, ids, row, out[way], up, compiled=compiled)
    np.testing.assert_allclose(out[1], out[0], rtol=0, atol=1e-13)


@pytest.mark.parametrize("exponent", [-150, -24, -21, -20, -19, 19, 20, 21, 24, 150])
def test_kernels_leave_no_wrong_value_to_any_scale(exponent: int) -> None:
    x = noisy(4, 200, 0.5, warp=0.3) * (1, 1, 1e-3)
    x[:100, 2] = (x[:100, 1] + x[:100, 3]) / 2 + np.geomspace(1e-18, 1e-10, 100)[:, None]  # flat, or nearly
    points, ids = cells(x * 10.0**exponent)
    out = np.empty((2, len(x)))
    with np.errstate(all="ignore"):  # with the JIT off kernels are NumPy's numbers, which warn
        for way, compiled in enumerate((False, True)):
            driver.cell_jens(points, ids, SURFACE_TYPES[BY_NAME["quad"].vtk_id], out[way], compiled=compiled)
    np.testing.assert_allclose(out[1], out[0], rtol=0, atol=1e-13)
    assert (np.sign(out[1]) == np.sign(out[0])).all()
    assert len(set(np.sign(out[1]))) > 1


@law
def test_special_values() -> None:
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    halves = square.copy()
    halves[2] = (0.5, 0.5, 0)  # on the line of its neighbours
    bow = square[[0, 2, 1, 3]][:, [2, 0, 1]]  # in space it has no normal
    lost = square.copy()
    lost[1, 0] = np.nan
    x = np.stack([halves, square[[0, 1, 1, 3]], lost])
    values = jens(x)
    assert (values[0], values[1]) == (0, 0)
    assert np.isnan(values[2])
    assert jens(bow[None])[0] == 0
    mesh = Mesh.from_arrays(*_mesh(x))
    assert meshgauge.measure(mesh).status.tolist() == [Status.DEGENERATE, Status.DEGENERATE, Status.NON_FINITE]
    twice = Mesh.from_arrays(square, {"quad": [(0, 1, 1, 3)]})
    assert meshgauge.measure(twice).status.tolist() == [Status.REPEATED_POINTS]


@law
@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("axis", [0, 2])
@pytest.mark.parametrize("name", ["triangle", "quad", "polygon", "triangle6"])
def test_a_coordinate_that_is_not_finite_is_no_pass(name: str, axis: int, value: float) -> None:
    x = in_space(TRIANGLE7[:6]) if name == "triangle6" else regular({"triangle": 3, "quad": 4}.get(name, 5))
    good, lost = x.copy(), x.copy()
    lost[1, axis] = value
    mesh = Mesh.from_arrays(np.concatenate([good, lost]), {name: np.arange(2 * len(x)).reshape(2, -1)})
    quality = meshgauge.measure(mesh)
    assert quality.status.tolist() == [Status.OK, Status.NON_FINITE]
    assert np.isnan(quality.values[1])


def _mesh(x: np.ndarray) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    points, ids = cells(x)
    return points, {NAMES.get(x.shape[1], "polygon"): ids}


@law
@pytest.mark.parametrize("n", [3, 4, 6])
def test_scale_and_place_change_nothing(n: int) -> None:
    x = noisy(n, 50, 0.3, warp=0.2)
    values = jens(x)
    for factor in (2.0**-600, 2.0**600):
        np.testing.assert_allclose(jens(x * factor), values, rtol=1e-12)
    np.testing.assert_array_equal(meshgauge.jens(*cells(x), NAMES.get(n, "polygon"), threads=2), values)


@law
def test_a_star_is_inverted_inside() -> None:
    star = regular(5)[[0, 2, 4, 1, 3]]
    for x in (star, turned(star)):
        mesh = Mesh.from_arrays(
            np.concatenate([x, turned(x, 2)[::-1] * 2]) if x is not star else x, {"polygon": [range(5)]}
        )
        quality = meshgauge.measure(mesh)
        assert quality.values[0] > 0
        assert quality.status.tolist() == [Status.INVERTED_INSIDE]
        assert quality.certificate.validity.tolist() == [Validity.INVALID]
    fine = meshgauge.measure(Mesh.from_arrays(regular(7), {"polygon": [range(7)]}))
    assert fine.status.tolist() == [Status.OK]
    assert fine.certificate.validity.tolist() == [Validity.VALID]


@law
@pytest.mark.parametrize("n", [3, 4, 5])
def test_a_certificate_bounds_the_least_determinant(n: int) -> None:
    x = noisy(n, 100, 0.35, warp=0.2, seed=9)
    quality = meshgauge.measure(Mesh.from_arrays(*_mesh(x)))
    bounds = quality.certificate
    assert ((bounds.lower > 0) == (bounds.validity == Validity.VALID)).all()
    assert (bounds.lower <= bounds.upper + 1e-12).all()
    assert ((quality.status == Status.OK) == (bounds.lower > 0)).all()
    ideal = meshgauge.measure(Mesh.from_arrays(*_mesh(turned(regular(n))[None]))).certificate
    assert ideal.lower[0] == pytest.approx(1, abs=1e-9)


# ---- curved cells --------------------------------------------------------------------------------------------------

SQUARE9 = np.array(
    [(0, 0), (1, 0), (1, 1), (0, 1), (0.5, 0), (1, 0.5), (0.5, 1), (0, 0.5), (0.5, 0.5)]
)  # fmt: skip
TRIANGLE7 = np.array([(0, 0), (1, 0), (0, 1), (0.5, 0), (0.5, 0.5), (0, 0.5), (1 / 3, 1 / 3)])


def in_space(x: np.ndarray) -> np.ndarray:
    return np.concatenate([x, np.zeros((*x.shape[:-1], 1))], axis=-1)


@pytest.mark.parametrize(
    ("name", "nodes", "linear"),
    [
        ("triangle6", TRIANGLE7[:6], "triangle"),
        ("triangle7", TRIANGLE7, "triangle"),
        ("quad6", SQUARE9[[0, 1, 2, 3, 4, 6]], "quad"),
        ("quad8", SQUARE9[:8], "quad"),
        ("quad9", SQUARE9, "quad"),
        ("lagrange_triangle", TRIANGLE7[:6], "triangle"),
        ("bezier_triangle", TRIANGLE7[:6], "triangle"),
        ("lagrange_quad", SQUARE9, "quad"),
        ("bezier_quad", SQUARE9, "quad"),
    ],
)
@pytest.mark.parametrize("space", [False, True])
def test_a_straight_curved_cell_is_the_linear_one(name: str, nodes: np.ndarray, linear: str, space: bool) -> None:
    x = nodes @ np.array([(1.3, 0.2), (-0.4, 0.9)])
    x = turned(in_space(x)) if space else in_space(x)
    n = 3 if linear == "triangle" else 4
    expected = meshgauge.jens(x[:n], [range(n)], linear)
    mesh = Mesh.from_arrays(x, {name: [range(len(x))]})
    quality = meshgauge.measure(mesh)
    np.testing.assert_allclose(quality.values, expected, rtol=1e-12)
    assert quality.status.tolist() == [Status.OK]
    assert quality.certificate.validity.tolist() == [Validity.VALID]
    if not space:
        turned_over = meshgauge.measure(Mesh.from_arrays(x[:, :2] * (-1, 1), {name: [range(len(x))]}))
        np.testing.assert_allclose(turned_over.values, -expected, rtol=1e-12)


def jacobian9(x: np.ndarray, r: np.ndarray, s: np.ndarray) -> np.ndarray:
    """Determinants of biquadratic cells ``(n, 9, 2)`` at places of the unit square."""

    def basis(t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        values = np.stack([(1 - t) * (1 - 2 * t), t * (2 * t - 1), 4 * t * (1 - t)])
        slopes = np.stack([4 * t - 3, 4 * t - 1, 4 - 8 * t])
        return values, slopes

    (a, da), (b, db) = basis(r), basis(s)
    at = [(0, 0), (1, 0), (1, 1), (0, 1), (2, 0), (1, 2), (2, 1), (0, 2), (2, 2)]
    along = np.stack([da[i] * b[j] for i, j in at])
    across = np.stack([a[i] * db[j] for i, j in at])
    u, v = np.einsum("np,cnk->cpk", along, x), np.einsum("np,cnk->cpk", across, x)
    return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]


def test_curved_cells_are_decided_inside() -> None:
    rng = np.random.default_rng(3)
    x = SQUARE9 + rng.uniform(-0.2, 0.2, (600, 9, 2))
    quality = meshgauge.measure(Mesh.from_arrays(x.reshape(-1, 2), {"quad9": np.arange(5400).reshape(-1, 9)}))
    r, s = (axis.ravel() for axis in np.meshgrid(np.linspace(0, 1, 41), np.linspace(0, 1, 41)))
    least = jacobian9(x, r, s).min(axis=1)
    at_corners = jacobian9(x, np.array([0.0, 1, 1, 0]), np.array([0.0, 0, 1, 1])).min(axis=1)
    np.testing.assert_array_equal(quality.values > 0, at_corners > 0)
    inside = quality.status[at_corners > 0]
    assert set(inside.tolist()) == {Status.OK, Status.INVERTED_INSIDE}
    # Samples can miss a small negative place, and never see one where there is none.
    assert not (least[quality.status == Status.OK] <= 0).any()
    assert (least[quality.status == Status.INVERTED_INSIDE] <= 0).mean() > 0.95
    assert (inside == Status.INVERTED_INSIDE).mean() == pytest.approx(0.245, abs=0.05)


def test_a_curved_edge_turns_a_corner() -> None:
    x = in_space(TRIANGLE7[:6])
    x[3, 1] = -0.25  # the edge bulges out: the corners at its ends open
    straight, curved = (
        meshgauge.scaled_jacobian(p, [range(6)], "triangle6", nodes=True)[0] for p in (in_space(TRIANGLE7[:6]), x)
    )
    np.testing.assert_allclose(straight, (1, sqrt(0.5), sqrt(0.5)), rtol=1e-12)
    tangent = np.array([1, -1]) / sqrt(2)
    assert curved[0] == pytest.approx(tangent[0])
    assert curved[1] == pytest.approx(1.0)
    assert curved[2] == pytest.approx(straight[2])


def test_polygons_of_two_points_are_counted_as_not_measured() -> None:
    mesh = Mesh(np.eye(3), np.array([7, 7], np.uint8), np.array([0, 2, 5]), np.array([0, 1, 0, 1, 2]))
    quality = meshgauge.measure(mesh)
    assert quality.status.tolist() == [Status.UNSUPPORTED, Status.OK]
    assert quality.summary().all.n_unmeasured == 1


@law
def test_companions_of_surface_cells() -> None:
    box = np.array([(0, 0), (4, 0), (4, 1), (0, 1)], float)
    quality = meshgauge.measure(
        Mesh.from_arrays(box, {"quad": [range(4)]}), metrics=["jens_mean", "shape", "edge_ratio", "warpage"]
    )
    values = {name: float(array[0]) for name, array in quality.metrics.items()}
    assert values == pytest.approx({"jens": 1, "jens_mean": 1, "shape": 8 / 17, "edge_ratio": 0.25, "warpage": 0})
    x = noisy(3, 200, 0.3)
    shape = meshgauge.METRICS["shape"]
    quality = meshgauge.measure(Mesh.from_arrays(*_mesh(turned(x.reshape(-1, 3)).reshape(x.shape))), metrics=[shape])
    a, b, c = (np.linalg.norm(x[:, i] - x[:, j], axis=1) for i, j in ((0, 1), (1, 2), (2, 0)))
    area = np.linalg.norm(newell(x), axis=1)
    # At every corner of a triangle the same: 4 √3 area over the sum of the squared edges.
    np.testing.assert_allclose(quality.metrics["shape"], 4 * sqrt(3) * area / (a**2 + b**2 + c**2), rtol=1e-9)
