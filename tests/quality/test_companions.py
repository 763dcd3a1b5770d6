"""What the companions of J_ENS see that it does not, against VTK's measures, and of polyhedra."""

from __future__ import annotations

import numpy as np
import pytest
from metric_cells import cell_values, random_cells

import meshgauge
from meshgauge import METRICS, Mesh, Polyhedra
from meshgauge.cells import SHAPES
from meshgauge.kernels import path as kernels_path
from meshgauge.quality.companions import companions
from meshgauge.surface_cells import SURFACE_SHAPES

BOX = np.array(SHAPES["hexahedron"].points)
NAMES = ("jens_mean", "shape", "edge_ratio", "warpage")


def of(name: str, x: np.ndarray, shape: str = "hexahedron") -> float:
    return float(cell_values(METRICS[name], shape, x[None])[0])


def test_a_stretched_box_is_ideal_for_jens_only() -> None:
    # The ideal hexahedron lies with an edge along each axis, or does not: stretch along one of its edges.
    edges = np.stack([BOX[1] - BOX[0], BOX[3] - BOX[0], BOX[4] - BOX[0]])
    places = np.linalg.solve(edges.T, (BOX - BOX[0]).T).T
    box = places * (8, 1, 1)
    assert of("jens", box) == pytest.approx(1.0)
    assert of("jens_mean", box) == pytest.approx(1.0)
    assert of("edge_ratio", box) == pytest.approx(1 / 8)
    assert of("shape", box) == pytest.approx(3 * 8 ** (2 / 3) / (64 + 2))
    assert of("warpage", box) == pytest.approx(0.0, abs=1e-12)


def test_the_mean_tells_one_bad_corner_from_all_bad() -> None:
    cell = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1.0)])
    one = cell.copy()
    one[6] = (0.45, 0.45, 0.45)
    assert of("jens", one) < 0 < of("jens_mean", one)
    nodes = meshgauge.jens(one, np.arange(8)[None], "hexahedron", nodes=True)
    assert of("jens_mean", one) == pytest.approx(nodes.mean())


@pytest.mark.parametrize("name", ["tetra", "hexahedron"])
def test_shape_is_verdicts(name: str) -> None:
    x = random_cells(SHAPES[name], 300, noise=0.3)
    ours, theirs = (cell_values(METRICS[one], name, x) for one in ("shape", "verdict_shape"))
    valid = ours > 0
    assert valid.sum() > 100
    np.testing.assert_allclose(ours[valid], theirs[valid], rtol=1e-9)


def test_edge_ratio_is_the_inverse_of_verdicts() -> None:
    x = random_cells(SHAPES["tetra"], 300)
    ours, theirs = (cell_values(METRICS[one], "tetra", x) for one in ("edge_ratio", "verdict_edge_ratio"))
    np.testing.assert_allclose(ours, 1 / theirs, rtol=1e-12)


def as_polyhedron(shape: str, x: np.ndarray) -> Mesh:
    faces = SHAPES[shape].faces
    poly = Polyhedra(
        np.array([0, len(faces)]),
        np.arange(len(faces)),
        np.r_[0, np.cumsum([len(f) for f in faces])],
        np.concatenate(faces),
    )
    return Mesh(x, np.array([42], np.uint8), np.array([0, len(x)]), np.arange(len(x)), poly)


@pytest.mark.parametrize("shape", ["tetra", "wedge", "hexahedron", "hexa_prism"])
def test_polyhedra_have_the_values_of_the_cells_that_they_are(shape: str) -> None:
    x = random_cells(SHAPES[shape], 1, noise=0.1)[0]
    quality = meshgauge.measure(as_polyhedron(shape, x), metrics=NAMES)
    for name in ("jens_mean", "edge_ratio", "shape"):
        assert quality.values_of(name)[0] == pytest.approx(of(name, x, shape), rel=1e-12)
    expected = of("warpage", x, shape) if METRICS["warpage"].is_defined_for(shape) else np.nan
    assert quality.values_of("warpage")[0] == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_the_edge_ratio_of_polyhedra_that_are_no_solids_or_very_small() -> None:
    tetra = np.array(SHAPES["tetra"].points) * [1.0, 1.0, 3.0]
    wrong = tetra.copy()
    wrong[0, 0] = np.inf
    points = np.vstack([tetra, wrong, np.zeros((4, 3)), 1e-310 * tetra])
    faces = np.array(SHAPES["tetra"].faces)
    face_points = np.concatenate([faces + 4 * cell for cell in range(4)]).reshape(-1)
    cells = np.array([0, 4, 4, 8, 12, 16])  # the second has no faces
    poly = Polyhedra(cells, np.arange(16), np.arange(0, 49, 3), face_points)
    ids = np.r_[np.arange(4), 0, np.arange(4, 16)]
    mesh = Mesh(points, np.full(5, 42, np.uint8), np.array([0, 4, 5, 9, 13, 17]), ids, poly)
    values = meshgauge.measure(mesh, metrics="edge_ratio").values_of("edge_ratio")
    expected = of("edge_ratio", tetra, "tetra")
    assert values == pytest.approx([expected, np.nan, np.nan, 0.0, expected], rel=1e-9, nan_ok=True)


def test_a_hanging_node_does_not_hide_that_a_face_is_a_quadrilateral() -> None:
    # A node in the middle of the edge 0-1, in both of its faces.
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1.4), (0, 1, 1.0)])
    plain = as_polyhedron("hexahedron", cube)
    faces = [list(face) for face in SHAPES["hexahedron"].faces]
    for face in faces:
        for at in range(len(face)):
            if {face[at], face[(at + 1) % len(face)]} == {0, 1}:
                face.insert(at + 1, 8)
                break
    assert sorted(map(len, faces)) == [4, 4, 4, 4, 5, 5]
    points = np.vstack([cube, [0.5, 0, 0]])
    poly = Polyhedra(
        np.array([0, 6]), np.arange(6), np.r_[0, np.cumsum([len(f) for f in faces])], np.concatenate(faces)
    )
    hung = Mesh(points, np.array([42], np.uint8), np.array([0, 9]), np.arange(9), poly)
    quality = meshgauge.measure(hung, metrics="warpage")
    assert quality.polyhedra is not None
    assert quality.polyhedra.node_is_hanging.sum() == 1
    expected = meshgauge.measure(plain, metrics="warpage").values_of("warpage")[0]
    assert quality.values_of("warpage")[0] == expected > 0.05
    cube[6] = (1, 1, 1)
    cube[1] = (1.0, -0.3, 0.2)  # now the faces in which the node hangs are warped most
    points = np.vstack([cube, 0.5 * (cube[0] + cube[1])])
    quality = meshgauge.measure(
        Mesh(points, np.array([42], np.uint8), np.array([0, 9]), np.arange(9), poly), metrics="warpage"
    )
    plain = as_polyhedron("hexahedron", cube)
    assert quality.values_of("warpage") == meshgauge.measure(plain, metrics="warpage").values_of("warpage")


def test_a_warped_face_is_seen() -> None:
    cell = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1.0)])
    cell[6, 2] += 0.3
    assert 0.05 < of("warpage", cell) < 1.0
    assert METRICS["warpage"].is_defined_for("wedge")
    assert not METRICS["warpage"].is_defined_for("tetra")


@pytest.mark.parametrize("compiled", [True, False], ids=["kernel", "numpy"])
@pytest.mark.parametrize("name", [*SHAPES, "triangle", "quad", "triangle in a plane", "quad in a plane"])
def test_summaries_beside_j_ens_are_those_of_the_metrics_measured(
    name: str, compiled: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    name, _, in_plane = name.partition(" ")
    x = random_cells({**SHAPES, **SURFACE_SHAPES}[name], 200, noise=0.5)
    if in_plane:
        x[..., 2] = 0.0  # some of the cells run clockwise
    x[3, 1] = x[3, 0]
    x[4] *= [1.0, 1.0, 0.0]
    x[5, 0, 0] = np.nan
    x[6] *= 1e-160
    cells = np.arange(x.shape[0] * x.shape[1]).reshape(x.shape[:2])
    quality = meshgauge.measure(Mesh.from_arrays(x.reshape(-1, 3), {name: cells}), metrics=["jens_mean", "edge_ratio"])
    monkeypatch.setattr(kernels_path, "NUMPY_UP_TO", 0 if compiled else 10**9)
    for threads in (1, 2):
        for one in companions(quality, threads=threads):
            expected, got = quality.summary(one.metric).all, one.all
            assert got.n_measured == expected.n_measured == 199
            assert (got.n_poor, got.n_good, got.statuses) == (
                expected.n_poor,
                expected.n_good,
                {status: n for status, n in expected.statuses.items() if status != "non_finite"},
            )
            assert got.mean == pytest.approx(expected.mean, abs=1e-14)
            assert got.quantiles() == pytest.approx(expected.quantiles(), abs=1e-14)


def test_summaries_beside_j_ens_leave_out_ghosts_and_know_polyhedra() -> None:
    cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1.0)])
    box = as_polyhedron("hexahedron", cube * [4.0, 1.0, 1.0])
    means, ratios = companions(meshgauge.measure(box))
    assert (means.all.n_measured, means.all.mean, ratios.all.mean) == (1, pytest.approx(1.0), pytest.approx(0.25))
    x = random_cells(SHAPES["tetra"], 3)
    mesh = Mesh.from_arrays(x.reshape(-1, 3), {"tetra": np.arange(12).reshape(3, 4)})
    ghost = mesh.replace(cell_data={"vtkGhostType": np.array([1, 0, 0], np.uint8)})
    assert [one.n_cells for one in companions(meshgauge.measure(ghost))] == [2, 2]


def test_the_edge_ratio_of_a_polyhedron_does_not_depend_on_the_cells_beside() -> None:
    x = random_cells(SHAPES["hexahedron"], 40, noise=0.2)
    x[7, 1] = x[7, 0]
    x[9] *= 1e-170
    faces = np.array(SHAPES["hexahedron"].faces)
    poly = Polyhedra(
        np.arange(0, 241, 6),
        np.arange(240),
        np.arange(0, 961, 4),
        np.concatenate([faces + 8 * cell for cell in range(40)]).reshape(-1),
    )
    mesh = Mesh(x.reshape(-1, 3), np.full(40, 42, np.uint8), np.arange(0, 321, 8), np.arange(320), poly)
    whole = meshgauge.measure(mesh, metrics="edge_ratio").values_of("edge_ratio")
    alone = [meshgauge.measure(mesh[c : c + 1], metrics="edge_ratio").values_of("edge_ratio")[0] for c in range(40)]
    np.testing.assert_array_equal(whole, alone)
    assert whole[7] == 0.0 < whole[9]
