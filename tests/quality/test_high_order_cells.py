"""Lagrange and Bézier cells of order 2, and some above, are measured as what they are, whatever a format calls them."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb, factorial, prod
from pathlib import Path
from typing import Any

import numpy as np
import optional
import pytest

import meshgauge
from meshgauge import Mesh, Status, measure
from meshgauge.cells import BY_NAME, BY_NODES, CellType
from meshgauge.mesh.high_order import DEGREES, WEIGHTS

both_paths = pytest.mark.usefixtures("path")

CURVED = [row for row in BY_NODES.values() if row.is_curved]
curved = pytest.mark.parametrize("row", CURVED, ids=[f"{row.name}-{row.n_nodes}" for row in CURVED])
VTK_NAMES = {"tetra": "Tetra", "hexahedron": "Hexahedron", "wedge": "Wedge"}


def straight(row: CellType) -> np.ndarray:
    """The ideal cell with its nodes, control points or not, where straight edges have them."""
    places = np.array(row.places[: row.n_nodes], float) / (row.unit or row.order)
    corners = np.array(row.shape.points)
    if row.shape.is_collapsed:
        r, s, t = places.T
        base = np.stack([(1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s], 1) * (1 - t)[:, None]
        return np.c_[base, t] @ corners
    axes = corners[{"tetra": [1, 2, 3], "wedge": [1, 2, 3], "hexahedron": [1, 3, 4]}[row.shape.name]] - corners[0]
    return corners[0] + places @ axes


def cloud(row: CellType, amplitude: float, n: int = 60, seed: int = 0) -> np.ndarray:
    """Cells ``(n, n_nodes, 3)`` with every node moved by up to the amplitude."""
    cell, amplitude = straight(row), amplitude * (2 / row.order) ** (1 if row.is_bernstein else 2)
    return cell + np.random.default_rng(seed).uniform(-amplitude, amplitude, (n, *cell.shape))


def separate(name: str, cells: np.ndarray, **data: Any) -> Mesh:
    """A mesh of cells that share no points."""
    n, n_nodes, _ = cells.shape
    return Mesh.from_arrays(cells.reshape(-1, 3), [(name, np.arange(n * n_nodes).reshape(n, n_nodes))], **data)


def on_curve(row: CellType, cells: np.ndarray) -> np.ndarray:
    """The points of Bézier cells at the places of their nodes: their Bernstein polynomials there."""
    places, n = np.array(row.places[: row.n_nodes]), row.order
    weights, axis = np.ones((len(places), len(places))), 0
    for size in row.shape.simplices:
        part = places[:, axis : axis + size - 1]
        powers = np.c_[n - part.sum(1), part]
        factor = np.array([factorial(n) / prod(factorial(x) for x in p) for p in powers.tolist()])
        weights *= factor * np.prod((powers / n)[:, None] ** powers[None], axis=2)
        axis += size - 1
    return np.einsum("pn,cnx->cpx", weights, cells)


@both_paths
@curved
def test_a_straight_cell_has_the_value_of_its_linear_cell(row: CellType) -> None:
    ideal = straight(row)
    turned = np.random.default_rng(1).normal(size=(12 if row.order <= 2 else 4, 3, 3))
    cells = np.einsum("nx,cxy->cny", ideal, turned)
    quality = measure(separate(row.name, cells))
    linear = measure(separate(row.shape.name, cells[:, list(row.corners)]))
    assert quality.values == pytest.approx(linear.values, abs=1e-9)
    assert np.array_equal(quality.status, linear.status)
    assert measure(separate(row.name, ideal[None])).values == pytest.approx([1], abs=1e-12)
    points, nodes = cells.reshape(-1, 3), np.arange(cells.shape[0] * cells.shape[1]).reshape(cells.shape[:2])
    assert meshgauge.jens(points, nodes, row.name) == pytest.approx(quality.values, abs=1e-12)


QUADRATIC = [row for row in CURVED if row.table in BY_NAME]


@both_paths
@pytest.mark.parametrize("amplitude", [0.03, 0.1, 0.2])
@pytest.mark.parametrize("row", QUADRATIC, ids=[row.table for row in QUADRATIC])
def test_a_lagrange_cell_is_the_quadratic_cell_of_as_many_nodes(row: CellType, amplitude: float) -> None:
    cells = cloud(row, amplitude)
    ours, theirs = measure(separate(row.name, cells)), measure(separate(row.table, cells))
    assert np.array_equal(ours.values, theirs.values)
    assert np.array_equal(ours.status, theirs.status)
    assert np.array_equal(ours.certificate.lower, theirs.certificate.lower)


BEZIER = [row for row in CURVED if row.is_bernstein]


@both_paths
@pytest.mark.parametrize("amplitude", [0.2, 0.4])
@pytest.mark.parametrize("row", BEZIER, ids=[row.kind for row in BEZIER])
def test_a_bezier_cell_is_the_lagrange_cell_through_its_points(row: CellType, amplitude: float) -> None:
    cells = cloud(row, amplitude)
    ours, theirs = (
        measure(separate(row.name, cells)),
        measure(separate(row.name.replace("bezier", "lagrange"), on_curve(row, cells))),
    )
    assert ours.values == pytest.approx(theirs.values, abs=1e-9)
    clear = np.abs(theirs.certificate.lower) > 1e-9
    assert np.array_equal(ours.status[clear], theirs.status[clear])
    assert len(np.unique(ours.status)) > 1 or amplitude < 0.3


def determinants(row: CellType, cells: np.ndarray, places: np.ndarray) -> np.ndarray:
    """``(n_cells, n_places)`` the Jacobian determinant as VTK's own cell has it, of a Bézier cell that through its
    points (VTK's derivatives of Bézier cells are wrong or crash without the grid that they are in)."""
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    cells = on_curve(row, cells) if row.is_bernstein else cells
    cell = getattr(model, f"vtkLagrange{VTK_NAMES[row.shape.name]}")()
    n = row.n_nodes or 0
    cell.GetPointIds().SetNumberOfIds(n)
    cell.GetPoints().SetNumberOfPoints(n)
    if hasattr(cell, "SetUniformOrderFromNumPoints"):
        cell.SetUniformOrderFromNumPoints(n)
    cell.Initialize()
    by_place = np.empty((len(places), 3, n))
    for at, place in zip(by_place, places, strict=True):
        derivatives = [0.0] * (3 * n)
        cell.InterpolateDerivs(tuple(place), derivatives)
        at[:] = np.reshape(derivatives, (n, 3)).T if row.shape.name == "hexahedron" else np.reshape(derivatives, (3, n))
    identity = by_place @ np.array(row.places) / (row.unit or row.order)
    assert np.abs(identity - np.eye(3)).max() < 1e-12
    jacobians = np.tensordot(by_place, cells, axes=(2, 1))  # place, direction, cell, axis
    return np.linalg.det(jacobians.transpose(2, 0, 1, 3))


@pytest.mark.parametrize("row", BEZIER, ids=[row.kind for row in BEZIER])
def test_points_of_bezier_cells_are_vtks(row: CellType) -> None:
    cells = cloud(row, 0.3, 3)
    grid = separate(row.name, cells).to_pyvista()
    expected = on_curve(row, cells)
    for n in range(3):
        cell = grid.GetCell(n)
        for place, point in zip(np.array(row.places) / row.order, expected[n], strict=True):
            x, weights = [0.0] * 3, [0.0] * len(point) * 100
            cell.EvaluateLocation(_mutable(0), tuple(place), x, weights)
            assert x == pytest.approx(point, abs=1e-12)


def _mutable(value: int) -> Any:
    from vtkmodules.vtkCommonCore import reference

    return reference(value)


def inside(row: CellType, n: int = 250) -> np.ndarray:
    """Random places in the reference cell, and its corners."""
    rng, name = np.random.default_rng(3), row.shape.name
    if name == "tetra":
        some = rng.dirichlet((0.6,) * 4, n)[:, 1:]
    elif name == "wedge":
        some = np.c_[rng.dirichlet((0.6,) * 3, n)[:, 1:], rng.beta(0.6, 0.6, n)]
    else:
        some = rng.beta(0.6, 0.6, (n, 3))
    return np.r_[np.array(row.shape.reference, float), some]


def is_full(row: CellType) -> bool:
    return row.n_nodes == prod(comb(row.order + size - 1, size - 1) for size in row.shape.simplices)


VTK_HAS = [row for row in CURVED if row.shape.name != "pyramid" and is_full(row)]


ABOVE = [row for row in VTK_HAS if row.order > 2 and not row.is_bernstein]


@pytest.mark.parametrize("row", ABOVE, ids=[row.kind for row in ABOVE])
def test_nodes_are_where_vtk_has_them(row: CellType) -> None:
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    cell, n = getattr(model, f"vtkLagrange{VTK_NAMES[row.shape.name]}")(), row.n_nodes
    cell.GetPointIds().SetNumberOfIds(n)
    cell.GetPoints().SetNumberOfPoints(n)
    if hasattr(cell, "SetUniformOrderFromNumPoints"):
        cell.SetUniformOrderFromNumPoints(n)
    cell.Initialize()
    theirs = np.reshape(cell.GetParametricCoords(), (-1, 3))[:n]
    assert np.array(row.places) / row.order == pytest.approx(theirs, abs=1e-12)


@pytest.mark.parametrize("row", ABOVE, ids=[row.kind for row in ABOVE])
def test_a_quadratic_cell_of_higher_order_is_the_quadratic_cell(row: CellType) -> None:
    """The same map with more nodes: the same values and decisions."""
    low = BY_NODES[row.vtk_id, {"tetra": 10, "wedge": 18, "hexahedron": 27}[row.shape.name]]
    cells = np.concatenate([cloud(low, amplitude, 6) for amplitude in (0.05, 0.1, 0.15)])
    places = np.array(row.places) / row.order
    values, axis = np.ones((len(places), low.n_nodes)), 0
    for size in row.shape.simplices:  # Lagrange's polynomials of order 2, at the nodes of the higher order
        x = np.c_[1 - places[:, axis : axis + size - 1].sum(1), places[:, axis : axis + size - 1]]
        part = np.array(low.places[: low.n_nodes])[:, axis : axis + size - 1]
        for node, p in enumerate(np.c_[2 - part.sum(1), part].tolist()):
            factors = [(1.0, v, v * (2 * v - 1))[k] for v, k in zip(x.T, p, strict=True)]
            values[:, node] *= prod(factors) * 4 ** (max(p) == 1)
        axis += size - 1
    ours = measure(separate(row.name, np.einsum("pn,cnx->cpx", values, cells)))
    theirs = measure(separate(low.name, cells))
    assert ours.values == pytest.approx(theirs.values, abs=1e-8)
    assert np.array_equal(ours.status, theirs.status)
    assert len(np.unique(ours.status)) > 1


@pytest.mark.parametrize("row", VTK_HAS, ids=[row.kind for row in VTK_HAS])
def test_no_determinant_of_vtk_is_below_what_is_certified(row: CellType) -> None:
    """Dense samples: none of a valid cell is negative, and cells with a negative one are invalid."""
    amplitudes = (0.2, 0.35, 0.5) if row.is_bernstein else (0.06, 0.12, 0.18)
    n = 100 if row.order <= 2 else 30
    cells = np.concatenate([cloud(row, amplitude, n) for amplitude in amplitudes])
    quality = measure(separate(row.name, cells))
    least = determinants(row, cells, inside(row, 250 if row.order < 4 else 2000)).min(1)
    is_valid = quality.status == Status.OK
    assert (least[is_valid] > 0).all()
    assert not is_valid[least < -1e-12].any()
    assert is_valid.any()
    assert (~is_valid).any()
    assert (quality.status == Status.INVERTED_INSIDE).any() or row.order > 2
    # What the samples see, and a little more.
    assert (~is_valid).sum() <= 1.3 * (least < 0).sum() + 3


def test_orders_that_differ_and_weights_that_differ_are_undecided() -> None:
    row = BY_NODES[73, 18]
    cells = np.repeat(straight(row)[None], 4, axis=0)
    degrees = np.array([(2, 2, 2), (1, 1, 5), (0, 0, 0), (2, 2, 2.0)])
    status = measure(separate(row.name, cells, cell_data={DEGREES: degrees})).status
    assert status.tolist() == [Status.OK, Status.UNDECIDED, Status.OK, Status.OK]
    row = BY_NODES[78, 10]
    cells = np.repeat(straight(row)[None], 3, axis=0)
    weights = np.ones((3, 10))
    weights[1], weights[2, 7] = 0.25, 1.5
    status = measure(separate(row.name, cells, point_data={WEIGHTS: weights.ravel()})).status
    assert status.tolist() == [Status.OK, Status.OK, Status.UNDECIDED]
    # A Lagrange cell has no weights.
    status = measure(separate("lagrange_tetra", cells, point_data={WEIGHTS: weights.ravel()})).status
    assert status.tolist() == [Status.OK] * 3


def test_of_another_number_of_nodes_it_is_undecided_never_ok() -> None:
    tetra = np.array(BY_NAME["tetra"].shape.points)
    for name, n in [("bezier_tetra", 15), ("bezier_pyramid", 14), ("bezier_wedge", 21), ("lagrange_pyramid", 15)]:
        corners = np.array(BY_NAME[BY_NAME[name].shape.name].shape.points)
        cell = np.r_[corners, np.repeat(corners.mean(0)[None], n - len(corners), axis=0)]
        assert measure(separate(name, cell[None])).status.tolist() == [Status.UNDECIDED]
    linear = measure(separate("lagrange_tetra", tetra[None]))
    assert linear.status.tolist() == [Status.OK]
    assert linear.certificate.lower == pytest.approx([1])


@both_paths
def test_a_mesh_of_several_numbers_of_nodes_is_measured_cell_by_cell() -> None:
    rows = [BY_NODES[72, 27], BY_NODES[71, 10], BY_NODES[72, 8], BY_NODES[72, 20], BY_NODES[72, 27], BY_NAME["tetra"]]
    cells = [cloud(row, 0.08, 1, seed)[0] for seed, row in enumerate(rows)]
    starts = np.cumsum([0, *map(len, cells)])
    mesh = Mesh.from_arrays(
        np.concatenate(cells),
        [(row.name, [np.arange(a, b)]) for row, a, b in zip(rows, starts[:-1], starts[1:], strict=True)],
    )
    quality = measure(mesh)
    for cell, (row, points) in enumerate(zip(rows, cells, strict=True)):
        alone = measure(separate(row.kind, points[None]))
        assert quality.values[cell] == pytest.approx(alone.values[0], abs=1e-12)
        assert quality.status[cell] == alone.status[0]
        assert quality.worst_node(cell).node == alone.worst_node(0).node
    assert quality.certificate.validity.tolist() == [0 if s == Status.OK else 1 for s in quality.status]


def written() -> Iterator[tuple[str, CellType]]:
    for row in VTK_HAS:
        if row.order > 2:
            continue
        for ending in (".vtu", ".vtk", ".vtkhdf"):
            yield ending, row


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize(("ending", "row"), list(written()), ids=lambda x: x if isinstance(x, str) else x.kind)
def test_files_keep_them_as_they_are(tmp_path: Path, ending: str, row: CellType) -> None:
    """A mesh that VTK wrote, and the one that we write back, as VTK reads it."""
    pyvista = pytest.importorskip("pyvista")
    cells = cloud(row, 0.08, 8)
    mesh = separate(row.name, cells)
    first, second = tmp_path / f"a{ending}", tmp_path / f"b{ending}"
    if ending == ".vtkhdf":
        meshgauge.write(first, mesh)
    else:
        pyvista.wrap(mesh.to_pyvista()).save(first)
    read = meshgauge.read(first)
    assert read.type_counts() == {row.name: 8}
    assert np.array_equal(read.points[read.connectivity], cells.reshape(-1, 3))
    quality = measure(read)
    assert np.array_equal(quality.values, measure(mesh).values)
    assert np.array_equal(quality.status, measure(mesh).status)
    meshgauge.write(second, read)
    grid = pyvista.read(second)
    assert (np.asarray(grid.celltypes) == row.vtk_id).all()
    assert np.array_equal(grid.points[grid.cell_connectivity], cells.reshape(-1, 3))


@pytest.mark.usefixtures("readers_here")
@pytest.mark.parametrize("vtk_id", [72, 79])
@pytest.mark.parametrize(("version", "is_old"), [("0.1", True), ("2.0", True), ("2.1", False), ("2.2", False)])
def test_older_files_have_two_edges_of_hexahedra_the_other_way_round(
    tmp_path: Path, vtk_id: int, version: str, is_old: bool
) -> None:
    row = BY_NODES[vtk_id, 27]
    cells = cloud(row, 0.05, 3)
    order = np.arange(27)
    order[[18, 19]] = (19, 18) if is_old else (18, 19)
    good = measure(separate(row.name, cells))
    meshgauge.write(tmp_path / "a.vtu", separate(row.name, cells[:, order]))
    data = (tmp_path / "a.vtu").read_bytes()
    start = data.index(b'version="') + 9
    (tmp_path / "b.vtu").write_bytes(data[:start] + version.encode() + data[data.index(b'"', start) :])
    assert np.array_equal(measure(meshgauge.read(tmp_path / "b.vtu")).values, good.values)
    legacy = "5.0" if is_old else "5.1"
    meshgauge.write(tmp_path / "a.vtk", separate(row.name, cells[:, order]))
    data = (tmp_path / "a.vtk").read_bytes()
    (tmp_path / "b.vtk").write_bytes(data.replace(b"Version 5.1", b"Version " + legacy.encode(), 1))
    assert np.array_equal(measure(meshgauge.read(tmp_path / "b.vtk")).values, good.values)


@pytest.mark.parametrize("by", ["raw", "inline"])
def test_orders_and_weights_are_known_by_their_mark_and_written_marked(tmp_path: Path, by: str) -> None:
    """VTK marks the arrays as attributes, under any name; without the mark VTK takes them for ordinary data."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader, vtkXMLUnstructuredGridWriter

    row = BY_NODES[78, 10]
    cells = np.repeat(straight(row)[None], 2, axis=0)
    grid = separate(row.name, cells).to_pyvista()
    weights = numpy_to_vtk(np.r_[np.ones(10), np.full(9, 1.0), 2.0], deep=True)
    degrees = numpy_to_vtk(np.full((2, 3), 2.0), deep=True)
    weights.SetName("w")
    degrees.SetName("d")
    grid.GetPointData().SetRationalWeights(weights)
    grid.GetCellData().SetHigherOrderDegrees(degrees)
    writer = vtkXMLUnstructuredGridWriter()
    if by == "raw":
        writer.SetDataModeToAppended()
        writer.EncodeAppendedDataOff()
    else:
        writer.SetDataModeToAscii()
    writer.SetFileName(str(tmp_path / "a.vtu"))
    writer.SetInputData(grid)
    writer.Write()
    mesh = meshgauge.read(tmp_path / "a.vtu")
    assert list(mesh.point_data) == [WEIGHTS]
    assert list(mesh.cell_data) == [DEGREES]
    assert measure(mesh).status.tolist() == [Status.OK, Status.UNDECIDED]
    meshgauge.write(tmp_path / "b.vtu", mesh)
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "b.vtu"))
    reader.Update()
    assert reader.GetOutput().GetPointData().GetRationalWeights().GetName() == WEIGHTS
    assert reader.GetOutput().GetCellData().GetHigherOrderDegrees().GetName() == DEGREES


@pytest.mark.parametrize("order", [3, 4])
def test_gmsh_agrees_above_second_order(tmp_path: Path, order: int) -> None:
    """Tetrahedra with every node moved, written by Gmsh: the sign of its minDetJac."""
    gmsh = optional.gmsh()
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addSphere(0, 0, 0, 1)
        gmsh.model.occ.synchronize()
        for name, value in (("MeshSizeMin", 0.9), ("MeshSizeMax", 1.1), ("ElementOrder", order)):
            gmsh.option.setNumber(f"Mesh.{name}", value)
        gmsh.model.mesh.generate(3)
        rng = np.random.default_rng(0)
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
        for tag, x in zip(tags, coordinates.reshape(-1, 3), strict=True):
            gmsh.model.mesh.setNode(tag, (x + rng.uniform(-0.025, 0.025, 3)).tolist(), [])
        _, (cells,), _ = gmsh.model.mesh.getElements(3)
        theirs = np.array(gmsh.model.mesh.getElementQualities(cells, "minDetJac"))
        gmsh.write(str(tmp_path / "a.msh"))
    finally:
        gmsh.finalize()
    mesh = meshgauge.read(tmp_path / "a.msh")
    status = measure(mesh).status[mesh.types == BY_NAME["lagrange_tetra"].vtk_id]
    assert np.array_equal(status == Status.OK, theirs > 0)
    assert (theirs > 0).any()
    assert (theirs < 0).any() or order == 3


def test_a_node_that_is_drawn_too_far_along_its_edge_turns_the_corner_inside_out() -> None:
    """The node of edge 0-1 at 3.5 of 4: x'(1) = -2, so the tangent at node 1 points away from node 0: -√2/2."""
    corners = np.array([(0, 0, 0), (4, 0, 0), (0, 4, 0), (0, 0, 4)], float)
    ends = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    cell = np.concatenate([corners, [corners[list(pair)].mean(axis=0) for pair in ends]])
    cell[4, 0] = 3.5
    for name in ("tetra10", "lagrange_tetra"):
        quality = measure(separate(name, cell[None]))
        assert quality.status.tolist() == [Status.INVERTED]
        assert quality.values == pytest.approx([-0.7071], abs=1e-4)
    # As a control point it is within the edge, whose tangent there is short, but right.
    assert measure(separate("bezier_tetra", cell[None])).status.tolist() == [Status.OK]


@both_paths
@pytest.mark.parametrize(
    ("shift", "status"),
    [(0.0, Status.DEGENERATE), (1e-13, Status.OK), (-1e-13, Status.INVERTED_INSIDE), (1e-17, Status.DEGENERATE)],
)
def test_a_determinant_that_touches_zero_inside(shift: float, status: Status) -> None:
    """x'(r) = 9 (3 r - 1)² and a little: zero at r = 1/3, which no cut in halves meets."""
    row = BY_NODES[BY_NAME["lagrange_hexahedron"].vtk_id, 64]
    places = np.array(row.places)
    cell = 3.0 * places
    cell[:, 0] = (np.array([0.0, 1.0, 2.0, 9.0]) + shift * np.arange(4))[places[:, 0]]
    assert measure(separate(row.name, cell[None])).status.tolist() == [status]
