"""Corners that are flat as far as their coordinates can tell: degenerate, whichever side of 0 rounding put them on."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshgauge import Mesh, Status, measure
from meshgauge.cells import CELL_TYPES
from meshgauge.doctor import diagnosis
from meshgauge.mesh.polyhedra import Polyhedra

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
FACES = np.array([(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)])
PRISM = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], float)
PYRAMID = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)], float)
TETRA = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0.3, 0.3, 1)], float)

FLAT = {
    "hexahedron": (CUBE, 6, (2, 5, 7), (0.2, 0.3, 0.5)),
    "wedge": (PRISM, 3, (0, 4, 5), (0.1, 0.45, 0.45)),
    "pyramid": (PYRAMID, 0, (1, 3, 4), (0.4, 0.4, 0.2)),
    "tetra": (TETRA, 3, (0, 1, 2), (0.2, 0.5, 0.3)),
}
"""Of each shape a node, three others in whose plane it is put, and where."""

CURVED = ("tetra10", "hexahedron20", "wedge15", "lagrange_tetra", "bezier_tetra")


def flat(kind: str) -> np.ndarray:
    points, node, others, weights = FLAT[kind]
    points = points.copy()
    points[node] = weights @ points[list(others)]
    return points


def with_middles(points: np.ndarray, name: str) -> np.ndarray:
    """The cell with the nodes of straight edges."""
    row = next(row for row in CELL_TYPES.values() if row.name == name)
    return np.vstack([points, [(points[e[0]] + points[e[1]]) / 2 for e in row.edges]])


def turned(points: np.ndarray, n: int, about: tuple[float, float, float] = (0, 0, 0)) -> np.ndarray:
    """``(n, n_nodes, 3)`` the cell turned in as many ways."""
    return np.einsum("nij,pj->npi", Rotation.random(n, random_state=7).as_matrix(), points - np.array(about))


def mesh_of(kind: str, cells: np.ndarray) -> Mesh:
    n, size = cells.shape[:2]
    nodes = np.arange(n * size).reshape(n, size)
    points = cells.reshape(-1, 3)
    if kind != "polyhedron":
        return Mesh.from_arrays(points, [(kind, nodes)])
    faces = (FACES + size * np.arange(n)[:, None, None]).reshape(-1)
    poly = Polyhedra(6 * np.arange(n + 1), np.arange(6 * n), 4 * np.arange(6 * n + 1), faces)
    return Mesh(points, np.full(n, 42, np.uint8), size * np.arange(n + 1), nodes.reshape(-1), poly)


def shapes_of(kind: str) -> np.ndarray:
    if kind in ("lagrange_tetra", "bezier_tetra"):  # of second order; straight, so that control points are middles
        return with_middles(flat("tetra"), "tetra10")
    if kind in ("polyhedron", "voxel"):
        return flat("hexahedron")
    if kind in FLAT:
        return flat(kind)
    return with_middles(flat(kind.rstrip("0123456789")), kind)


@pytest.mark.parametrize("about", [(0, 0, 0), (0.5, 0.5, 0.5), (0.3, -2, 7)], ids=str)
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("kind", [*FLAT, "polyhedron", *CURVED])
def test_a_flat_corner_is_degenerate_however_the_cell_is_turned(
    kind: str, precision: str, about: tuple[float, float, float]
) -> None:
    cells = turned(shapes_of(kind), 150, about)
    mesh = mesh_of(kind, cells.astype(np.float32) if precision == "single" else cells)
    quality = measure(mesh)
    assert set(quality.status.tolist()) == {Status.DEGENERATE}
    # The value is what the coordinates as stored give, on either side of 0.
    assert (quality.values < 0).any()
    assert (quality.values > 0).any()
    assert np.abs(quality.values).max() < (1e-4 if precision == "single" else 1e-12)
    assert quality.summary().all.n_invalid == 0
    found = diagnosis(mesh, quality)
    assert found.finding("orientation") is None
    assert found.finding("misoriented_faces") is None


@pytest.mark.usefixtures("path")
@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("kind", ["hexahedron", "tetra", "polyhedron"])
def test_many_cells_and_any_number_of_threads_give_the_same(kind: str, precision: str) -> None:
    cells = np.tile(turned(shapes_of(kind), 200), (11, 1, 1))
    mesh = mesh_of(kind, cells.astype(np.float32) if precision == "single" else cells)
    for threads in (1, 2):
        assert set(measure(mesh, threads=threads).status.tolist()) == {Status.DEGENERATE}


def test_the_precision_of_the_file_counts_not_that_of_the_array() -> None:
    cells = turned(shapes_of("hexahedron"), 100).astype(np.float32).astype(np.float64)
    assert set(measure(mesh_of("hexahedron", cells)).status.tolist()) == {Status.OK, Status.INVERTED}
    assert set(measure(mesh_of("hexahedron", cells).replace(stored="single")).status.tolist()) == {Status.DEGENERATE}


@pytest.mark.parametrize("precision", ["single", "double"])
@pytest.mark.parametrize("kind", ["hexahedron", "polyhedron"])
def test_what_is_off_by_more_than_rounding_keeps_its_side(kind: str, precision: str) -> None:
    unit = np.finfo(np.float32 if precision == "single" else np.float64).eps
    inward = -np.ones(3) / np.sqrt(3)  # from the corner at (1, 1, 1)
    for side, expected in ((40, Status.INVERTED), (-40, Status.OK)):
        points = flat("hexahedron")
        points[6] += inward * side * unit
        cells = turned(points, 200)
        status = measure(mesh_of(kind, cells.astype(np.float32) if precision == "single" else cells)).status
        # A polyhedron that a point sees is concave.
        if kind == "polyhedron" and expected == Status.INVERTED:
            expected = Status.CONCAVE
        assert set(status.tolist()) == {expected}


def test_a_corner_that_is_negative_beyond_rounding_decides() -> None:
    points = flat("hexahedron")
    points[0] = (0.8, 0.8, 0.8)
    assert set(measure(mesh_of("hexahedron", turned(points, 50))).status.tolist()) == {Status.INVERTED}


@pytest.mark.parametrize("height", [1, -1])
def test_a_layer_one_unit_high_stands_as_it_is_stored(height: int) -> None:
    """Its edges are at right angles to one another: above the limit, the stored sign is what a solver will see."""
    layer = CUBE.astype(np.float32)
    layer[4:, 2] = np.nextafter(np.float32(1.0), np.float32(1.0 + height))
    layer[:4, 2] = 1.0
    quality = measure(mesh_of("hexahedron", layer[None]))
    assert quality.status.tolist() == [Status.OK if height > 0 else Status.INVERTED]
    assert quality.values.tolist() == [height]


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1e200, 1e300])
def test_any_unit_gives_the_same(scale: float) -> None:
    cells = turned(shapes_of("hexahedron"), 50) * scale
    assert set(measure(mesh_of("hexahedron", cells)).status.tolist()) == {Status.DEGENERATE}
    points = flat("hexahedron")
    points[6] += 1e-10
    assert set(measure(mesh_of("hexahedron", turned(points, 50) * scale)).status.tolist()) == {Status.OK}
