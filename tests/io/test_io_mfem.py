"""MFEM's curved meshes: files that MFEM wrote, whose straight cells have every node where its place in the cell is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meshgauge
from meshgauge import Mesh, Status, io
from meshgauge.cells import CellType
from meshgauge.mesh.high_order import row_of

DATA = Path(__file__).parent / "data" / "mfem"


def on_straight_cell(row: CellType, corners: np.ndarray) -> np.ndarray:
    """Where the nodes of a straight cell are, ``(n_nodes, 3)``."""
    r, s, t = np.array(row.places[: row.n_nodes], float).T / max(row.order, 1)
    if row.shape.name == "tetra":
        weights = [1 - r - s - t, r, s, t]
    elif row.shape.name == "wedge":
        weights = [w * height for height in (1 - t, t) for w in (1 - r - s, r, s)]
    elif row.shape.name == "pyramid":
        weights = [*(w * (1 - t) for w in ((1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s)), t]
    else:
        weights = [w * h for h in (1 - t, t) for w in ((1 - r) * (1 - s), r * (1 - s), r * s, (1 - r) * s)]
    return np.stack(weights, 1) @ corners


SOLIDS = {
    "bergot": ["wedge18", "hexahedron27", "lagrange_pyramid", "tetra10", "tetra10"],
    "fuentes": ["wedge18", "hexahedron27", "lagrange_pyramid", "tetra10", "tetra10"],
    "h1pos": ["bezier_wedge", "bezier_hexahedron", "bezier_tetra"],
    "l2": ["wedge18", "hexahedron27", "tetra10"],
    "l2pos": ["bezier_wedge", "bezier_hexahedron", "bezier_tetra"],
    "l2p1": ["wedge", "hexahedron", "tetra"],
}


@pytest.mark.parametrize("name", SOLIDS)
def test_every_node_is_in_its_place(name: str) -> None:
    mesh = io.read(DATA / f"{name}.mesh")
    names = [meshgauge.CELL_TYPES[t].name for t in mesh.types if meshgauge.CELL_TYPES[t].dimension == 3]
    assert names == SOLIDS[name]
    quality = meshgauge.measure(mesh)
    for cell in range(len(names)):
        row, points = row_of(mesh, cell), mesh.points[mesh.nodes(cell)]
        if row.n_nodes is None:  # the pyramid with a node inside, in a space of its own
            assert name == "fuentes"
            assert len(points) == 15
            assert quality.status[cell] == Status.UNDECIDED
            continue
        assert points == pytest.approx(on_straight_cell(row, points[: row.shape.n_nodes]), abs=1e-14)
        assert quality.status[cell] == Status.OK
    # Boundary elements are on points of the solids, which fit: no point is there twice.
    assert len(np.unique(mesh.points, axis=0)) == mesh.n_points
    assert np.isin(mesh.connectivity, np.concatenate([mesh.nodes(c) for c in range(len(names))])).all()


@pytest.mark.parametrize("name", ["bergot", "h1pos", "l2"])
def test_values_of_straight_cells_are_those_of_the_linear_ones(name: str) -> None:
    mesh = io.read(DATA / f"{name}.mesh")
    for cell in range(len(SOLIDS[name])):
        row = row_of(mesh, cell)
        corners = mesh.points[mesh.nodes(cell)[: row.shape.n_nodes]]
        linear = Mesh.from_arrays(corners, [(row.shape.name, [range(len(corners))])])
        assert meshgauge.measure(mesh).values[cell] == pytest.approx(meshgauge.measure(linear).values[0], abs=1e-9)


def test_a_periodic_mesh_has_a_point_for_every_place_of_a_vertex(tmp_path: Path) -> None:
    """Two hexahedra in a ring: where it closes, its vertices are at both ends."""
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    nodes = np.concatenate([corners, corners + np.array((1, 0, 0))])
    (tmp_path / "a.mesh").write_text(
        "MFEM mesh v1.0\n\ndimension\n3\n\nelements\n2\n1 5 0 1 3 2 4 5 7 6\n1 5 1 0 2 3 5 4 6 7\n\nboundary\n0\n\n"
        "vertices\n8\n\nnodes\nFiniteElementSpace\nFiniteElementCollection: L2_T1_3D_P1\nVDim: 3\nOrdering: 1\n\n"
        + "\n".join(map(str, nodes.ravel()))
    )
    mesh = io.read(tmp_path / "a.mesh")
    assert mesh.n_points == 12
    assert meshgauge.measure(mesh).values.tolist() == [1, 1]


@pytest.mark.parametrize(
    ("space", "message"),
    [
        ("L2_3D_P2", "nodes in the space 'L2_3D_P2' cannot be read"),
        ("L2_T1_3D_P3", "55 nodes of order 3, expected 124"),
        ("H1_3D_P2", "nodes of order 2, expected"),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, space: str, message: str) -> None:
    text = (DATA / "l2.mesh").read_text().replace("L2_T1_3D_P2", space)
    (tmp_path / "a.mesh").write_text(text)
    with pytest.raises(meshgauge.ReadError, match=message):
        io.read(tmp_path / "a.mesh")
